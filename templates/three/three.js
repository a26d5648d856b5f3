// What the viewer uses of three.js.
export {
  ArrowHelper, BufferAttribute, BufferGeometry, Color, CylinderGeometry, DirectionalLight,
  EdgesGeometry, GridHelper, Group, HemisphereLight, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, PlaneGeometry, Quaternion, Raycaster,
  Scene, ShadowMaterial, SphereGeometry, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
