// The viewer: a model turned with the mouse, plots beside it, one time for both.
"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  let first = { azimuth: 0, elevation: 0, zoom: 1 };
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const CURVES = ["#4878d0", "#ee854a", "#3f9e5a", "#d65f5f", "#956cb4", "#8c613c", "#dc7ec0", "#797979", "#b8a500", "#2fa4b5"];
  const curve = (index) => CURVES[index % CURVES.length];
  const state = { t: 0, playing: false, speed: 1, hovered: -1 };
  let model, motion;

  // --- the model ---------------------------------------------------------------------------------
  const canvas = $("model");
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
  renderer.shadowMap.enabled = true;
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(25, 1, 1e-3, 10);
  camera.up.set(0, 0, 1);
  const controls = new THREE.OrbitControls(camera, canvas);
  const sun = new THREE.DirectionalLight(0xffffff, 2.4);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.radius = 3;
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 1.5), sun, sun.target);
  const world = new THREE.Group();
  scene.add(world);
  let bodies = [], hinges = [], bands = [], arrows = [], drawn = "";
  const UP = new THREE.Vector3(0, 1, 0);

  function build() {
    world.traverse((part) => { part.geometry?.dispose(); part.material?.dispose(); });
    world.clear();
    const size = model.size;
    bodies = model.bodies.map((body) => {
      const group = new THREE.Group();
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(body.corners), 3));
      const colors = new Float32Array(body.corners.length);
      const color = new THREE.Color();
      body.colors.forEach((index, triangle) => {
        color.set(model.colors[index]);
        for (let corner = 0; corner < 3; corner++) color.toArray(colors, 9 * triangle + 3 * corner);
      });
      geometry.setAttribute("color", new THREE.BufferAttribute(colors, 3));
      geometry.computeVertexNormals();
      const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({
        vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
      mesh.castShadow = mesh.receiveShadow = true;
      group.add(mesh, new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 30),
        new THREE.LineBasicMaterial({ color: 0x26302a, transparent: true, opacity: 0.55 })));
      world.add(group);
      return group;
    });
    // A hinge line is a thin rod, with a thicker one, not drawn, to be pointed at.
    hinges = model.hinges.map((hinge) => {
      const [a, b] = hinge.ends.map((end) => new THREE.Vector3(...end));
      const rod = (radius, material) => {
        const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, a.distanceTo(b), 8), material);
        mesh.position.copy(a).add(b).multiplyScalar(0.5);
        mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), b.clone().sub(a).normalize());
        bodies[hinge.body].add(mesh);
        return mesh;
      };
      const line = rod(0.0025 * size, new THREE.MeshBasicMaterial({ color: 0xd63031 }));
      const target = rod(0.015 * size, new THREE.MeshBasicMaterial({ visible: false }));
      return { line, target };
    });
    for (const point of model.points) {
      const dot = new THREE.Mesh(new THREE.SphereGeometry(0.008 * size, 16, 12), new THREE.MeshBasicMaterial({ color: 0x143c78 }));
      dot.position.set(...point.at);
      bodies[point.body].add(dot);
    }
    // Springs and tendons: a rod from point to point.
    bands = model.bands.map((band) => ({ ...band, rods: band.through.slice(1).map(() => {
      const rod = new THREE.Mesh(new THREE.CylinderGeometry(0.004 * size, 0.004 * size, 1, 8), new THREE.MeshBasicMaterial({ color: 0xc47014 }));
      world.add(rod);
      return rod;
    }) }));
    for (const wall of model.walls) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(wall.lines.flat()), 3));
      (bodies[wall.body] ?? world).add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x96a0ac, transparent: true, opacity: 0.6 })));
    }
    // Contact points, and arrows for the forces on them, seen through whatever hides them.
    arrows = model.contacts.map((contact) => {
      const dot = new THREE.Mesh(new THREE.SphereGeometry(0.009 * size, 16, 12), new THREE.MeshBasicMaterial({ color: 0x168c48 }));
      dot.position.set(...contact.at);
      bodies[contact.body].add(dot);
      const arrow = new THREE.ArrowHelper(UP, new THREE.Vector3(), 1, 0x168c48);
      for (const part of [arrow.line, arrow.cone]) Object.assign(part, { renderOrder: 1 }).material.depthTest = false;
      world.add(arrow);
      return arrow;
    });
    const [low, high] = model.extent.map((corner) => new THREE.Vector3(...corner));
    const middle = low.clone().add(high).multiplyScalar(0.5);
    const reach = Math.max(low.distanceTo(high) / 2, 1e-6);
    // What touches the ground sinks in a little, and is not hidden by it.
    const ground = model.ground - 0.002 * size;
    const square = 10 ** Math.floor(Math.log10(reach / 3));
    const grid = new THREE.GridHelper(2 * square * Math.ceil(3 * reach / square), 2 * Math.ceil(3 * reach / square), 0x9aa3ae, 0x9aa3ae);
    grid.rotation.x = Math.PI / 2;
    grid.position.set(square * Math.round(middle.x / square), square * Math.round(middle.y / square), ground);
    grid.material.transparent = true;
    grid.material.opacity = 0.25;
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(40 * reach, 40 * reach), new THREE.ShadowMaterial({ opacity: 0.22 }));
    plane.position.set(middle.x, middle.y, ground);
    plane.receiveShadow = true;
    world.add(grid, plane);
    const length = 0.18 * reach;
    [[1, 0, 0, 0xc82d2d], [0, 1, 0, 0x288c3c], [0, 0, 1, 0x2d55c8]].forEach(([x, y, z, color]) => {
        // Axes of the base frame, seen through whatever hides them.
        const arrow = new THREE.ArrowHelper(new THREE.Vector3(x, y, z), new THREE.Vector3(), length, color, 0.18 * length, 0.09 * length);
        for (const part of [arrow.line, arrow.cone]) Object.assign(part, { renderOrder: 1 }).material.depthTest = false;
        world.add(arrow);
      });
    const { azimuth, elevation, zoom } = first;
    const from = (azimuth, elevation) => new THREE.Vector3(
      Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation));
    sun.position.copy(middle).addScaledVector(from(azimuth - 0.7, 0.95), 4 * reach);
    sun.target.position.copy(middle);
    Object.assign(sun.shadow.camera, { left: -1.6 * reach, right: 1.6 * reach, top: 1.6 * reach, bottom: -1.6 * reach, near: 0.1 * reach, far: 10 * reach });
    sun.shadow.camera.updateProjectionMatrix();
    sun.shadow.normalBias = 0.004 * reach;
    sun.shadow.bias = -0.0005;
    // A model that was only changed is not looked at anew.
    if (drawn !== model.name) {
      drawn = model.name;
      controls.target.copy(middle);
      const far = 0.8 * reach / Math.sin(12.5 * Math.PI / 180);
      camera.near = far / 200;
      camera.far = far * 20;
      camera.position.copy(middle).addScaledVector(from(azimuth, Math.min(Math.abs(elevation), 1.57) * Math.sign(elevation || 1)), far / zoom);
      controls.update();
    }
    $("legend").replaceChildren(...model.materials.map(([name, color]) => {
      const entry = document.createElement("span");
      const patch = document.createElement("i");
      patch.style.background = color;
      entry.append(patch, name);
      return entry;
    }));
    if (model.scale) {
      const entry = document.createElement("span");
      entry.textContent = `\u2191 contact forces: ${Number((1e3 * model.scale.length).toPrecision(6))} mm are ${model.scale.label}`;
      $("legend").append(entry);
    }
    document.querySelectorAll("h1").forEach((title) => { title.textContent = model.name; });
    document.title = model.name;
  }

  // Samples before and after a time, and the share of the way between them.
  function between(t) {
    const times = motion.t;
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle; else high = middle;
    }
    const whole = times[high] - times[low];
    return [low, high, whole > 0 ? Math.min(Math.max((t - times[low]) / whole, 0), 1) : 0];
  }

  const turn = new THREE.Quaternion();
  function pose() {
    const [before, after, share] = between(state.t);
    bodies.forEach((group, body) => {
      const poses = motion.poses[body];
      group.quaternion.fromArray(poses, 7 * before).slerp(turn.fromArray(poses, 7 * after), share);
      group.position.fromArray(poses, 7 * before + 4);
      group.position.lerp(new THREE.Vector3().fromArray(poses, 7 * after + 4), share);
    });
    const place = ({ body, at }) => new THREE.Vector3(...at).applyQuaternion(bodies[body].quaternion).add(bodies[body].position);
    for (const { through, slack, rods } of bands) {
      const points = through.map((point) => place(model.points[point]));
      const lengths = rods.map((_, index) => points[index].distanceTo(points[index + 1]));
      const thick = lengths.reduce((a, b) => a + b) > slack ? 1 : 0.4;
      rods.forEach((rod, index) => {
        rod.position.copy(points[index]).add(points[index + 1]).multiplyScalar(0.5);
        rod.quaternion.setFromUnitVectors(UP, points[index + 1].clone().sub(points[index]).normalize());
        rod.scale.set(thick, lengths[index], thick);
      });
    }
    arrows.forEach((arrow, contact) => {
      const forces = motion.forces[contact];
      const force = new THREE.Vector3().fromArray(forces, 3 * before).lerp(new THREE.Vector3().fromArray(forces, 3 * after), share);
      const length = model.scale ? force.length() / model.scale.force * model.scale.length : 0;
      arrow.visible = length > 1e-3 * model.size;
      if (!arrow.visible) return;
      arrow.position.copy(place(model.contacts[contact]));
      arrow.setDirection(force.normalize());
      arrow.setLength(length, 0.25 * length, 0.12 * length);
    });
    hinges.forEach(({ line }, index) => {
      const on = index === state.hovered;
      line.material.color.set(on ? 0xffb400 : 0xd63031);
      line.scale.set(on ? 2 : 1, 1, on ? 2 : 1);
    });
  }

  // --- plots -------------------------------------------------------------------------------------
  const MARGIN = { left: 46, right: 8, top: 6, bottom: 20 };
  let plots = [];

  function ticks(low, high, count) {
    const rough = Math.max((high - low) / count, 1e-300);
    const decade = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((times) => times * decade).find((step) => step >= rough);
    const found = [];
    for (let tick = Math.ceil(low / step - 1e-9) * step; tick <= high + 1e-9 * step; tick += step) {
      found.push(Number(tick.toPrecision(12)) || 0);
    }
    return found;
  }

  function buildPlots() {
    const deg = (rows) => rows.map((row) => row.map((value) => value * 180 / Math.PI));
    const shown = [
      { title: "angles, deg", names: motion.joints, curves: deg(motion.q), joints: true },
      { title: "speeds, deg/s", names: motion.joints, curves: deg(motion.u), joints: true },
      { title: "energy, J", names: ["kinetic", "potential"], curves: [motion.kinetic, motion.potential], joints: false },
    ];
    const size = (forces) => motion.t.map((_, sample) => Math.hypot(...forces.slice(3 * sample, 3 * sample + 3)));
    if (model.scale) shown.push({ title: "contact forces, N", names: model.contacts.map(({ name }) => name), curves: motion.forces.map(size), joints: false });
    const holder = $("plots");
    holder.replaceChildren();
    // A fold has neither speeds nor energies nor forces.
    plots = shown.slice(0, motion.unit === "s" ? 4 : 1).map((plot) => {
      const title = document.createElement("h2");
      title.textContent = plot.title;
      const canvas = document.createElement("canvas");
      canvas.className = "plot";
      holder.append(title, canvas);
      if (plot.title.startsWith("angles") || !plot.joints) holder.append(names(plot));
      const all = plot.curves.flat();
      const low = all.reduce((a, b) => Math.min(a, b), Infinity);
      const high = all.reduce((a, b) => Math.max(a, b), -Infinity);
      const room = 0.06 * (high - low) || Math.abs(high) * 0.1 || 1;
      Object.assign(plot, { canvas, low: low - room, high: high + room });
      const seek = (event) => {
        const box = canvas.getBoundingClientRect();
        const share = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
        go(motion.t[0] + share * (end() - motion.t[0]));
      };
      canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); seek(event); });
      canvas.addEventListener("pointermove", (event) => {
        if (event.buttons & 1) seek(event);
        const found = nearest(plot, event);
        hover(plot.joints ? found : -1);
        tip(found < 0 ? null : event, plot.names[found], found < 0 ? "" : value(plot, found));
      });
      canvas.addEventListener("pointerleave", () => { hover(-1); tip(null); });
      return plot;
    });
  }

  function names(plot) {
    const list = document.createElement("div");
    list.className = "names";
    plot.names.forEach((name, index) => {
      const entry = document.createElement("span");
      const patch = document.createElement("i");
      patch.style.background = curve(index);
      entry.append(patch, name);
      if (plot.joints) {
        entry.addEventListener("pointerenter", () => hover(index));
        entry.addEventListener("pointerleave", () => hover(-1));
      }
      list.append(entry);
    });
    return list;
  }

  function at(values, t) {
    const [before, after, share] = between(t);
    return values[before] + share * (values[after] - values[before]);
  }

  const value = (plot, index) => `${at(plot.curves[index], state.t).toPrecision(4)} ${plot.title.split(", ")[1]}`;

  function place(plot, box) {
    const width = box.width - MARGIN.left - MARGIN.right;
    const height = box.height - MARGIN.top - MARGIN.bottom;
    const start = motion.t[0], whole = Math.max(end() - start, 1e-300);
    return {
      x: (t) => MARGIN.left + width * (t - start) / whole,
      y: (v) => MARGIN.top + height * (plot.high - v) / (plot.high - plot.low),
      t: (x) => start + whole * (x - MARGIN.left) / width,
    };
  }

  function nearest(plot, event) {
    const box = plot.canvas.getBoundingClientRect();
    const to = place(plot, box);
    const t = to.t(event.clientX - box.left);
    let best = -1, least = 10;
    plot.curves.forEach((curve, index) => {
      const away = Math.abs(to.y(at(curve, t)) - (event.clientY - box.top));
      if (away < least) [best, least] = [index, away];
    });
    return best;
  }

  function drawPlot(plot) {
    const box = plot.canvas.getBoundingClientRect();
    const scale = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(box.width * scale), Math.round(box.height * scale)];
    if (plot.canvas.width !== width || plot.canvas.height !== height) [plot.canvas.width, plot.canvas.height] = [width, height];
    const pen = plot.canvas.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, box.width, box.height);
    pen.font = "11px system-ui, sans-serif";
    const to = place(plot, box);
    const [front, faint] = [css("--faint"), css("--line")];
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    const level = ticks(plot.low, plot.high, 5);
    const digits = (value) => Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3) ? value.toExponential(1) : String(value);
    for (const tick of level) {
      pen.strokeStyle = faint;
      pen.beginPath();
      pen.moveTo(MARGIN.left, to.y(tick));
      pen.lineTo(box.width - MARGIN.right, to.y(tick));
      pen.stroke();
      pen.fillStyle = front;
      pen.fillText(digits(tick), MARGIN.left - 5, to.y(tick));
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const tick of ticks(motion.t[0], end(), 5)) pen.fillText(`${digits(tick)} ${motion.unit}`, Math.min(to.x(tick), box.width - 16), box.height - MARGIN.bottom + 5);
    plot.curves.forEach((values, index) => {
      const dim = plot.joints && state.hovered >= 0 && state.hovered !== index;
      pen.globalAlpha = dim ? 0.2 : 1;
      pen.strokeStyle = curve(index);
      pen.lineWidth = plot.joints && state.hovered === index ? 2.6 : 1.5;
      pen.beginPath();
      values.forEach((value, sample) => pen.lineTo(to.x(motion.t[sample]), to.y(value)));
      pen.stroke();
    });
    pen.globalAlpha = 1;
    pen.strokeStyle = css("--accent");
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(to.x(state.t), MARGIN.top);
    pen.lineTo(to.x(state.t), box.height - MARGIN.bottom);
    pen.stroke();
  }

  // --- time --------------------------------------------------------------------------------------
  const end = () => motion.t[motion.t.length - 1];

  function go(t) {
    state.t = Math.min(Math.max(t, motion.t[0]), end());
    stale = true;
  }

  function play(on) {
    if (!motion) return;
    if (on && state.t >= end()) go(motion.t[0]);
    state.playing = on;
    $("play").classList.toggle("on", on);
  }

  function hover(joint) {
    if (state.hovered !== joint) [state.hovered, stale] = [joint, true];
  }

  function tip(event, name, text) {
    const tip = $("tip");
    tip.hidden = !event;
    if (!event) return;
    tip.textContent = `${name}  ${text}`;
    tip.style.left = `${Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8)}px`;
    tip.style.top = `${Math.max(event.clientY - 30, 4)}px`;
  }

  const ray = new THREE.Raycaster();
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) return tip(null);
    const box = canvas.getBoundingClientRect();
    ray.setFromCamera(new THREE.Vector2(
      (event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2), camera);
    const hit = ray.intersectObjects(hinges.map(({ target }) => target))[0];
    const found = hit ? hinges.findIndex(({ target }) => target === hit.object) : -1;
    hover(found);
    tip(found < 0 ? null : event, found < 0 ? "" : model.hinges[found].name, found < 0 ? "" : value(plots[0], found));
  });
  canvas.addEventListener("pointerleave", () => { hover(-1); tip(null); });

  $("play").addEventListener("click", () => play(!state.playing));
  $("scrub").addEventListener("input", (event) => go(Number(event.target.value)));
  for (const speed of [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 5]) $("speed").add(new Option(`${speed}\u00D7`, speed, speed === 1, speed === 1));
  $("speed").addEventListener("change", (event) => { state.speed = Number(event.target.value); });
  addEventListener("keydown", (event) => {
    if (!motion) return;
    if (event.target.matches("select, input[type=range]") && event.key !== " ") return;
    const step = (event.shiftKey ? 10 : 1) * (end() - motion.t[0]) / Math.max(motion.t.length - 1, 1);
    const action = {
      " ": () => play(!state.playing),
      ArrowLeft: () => { play(false); go(state.t - step); },
      ArrowRight: () => { play(false); go(state.t + step); },
      Home: () => go(motion.t[0]),
      End: () => go(end()),
    }[event.key];
    if (action) { event.preventDefault(); action(); }
  });

  let stale = true, last = 0, width = 0, height = 0;
  controls.addEventListener("change", () => { stale = true; });
  addEventListener("resize", () => { stale = true; });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { stale = true; });

  function frame(now) {
    const passed = Math.min((now - last) / 1000, 0.1);
    last = now;
    if (state.playing && motion) {
      const t = state.t + passed * state.speed * motion.rate;
      // The end is seen before it begins again.
      go(state.t >= end() ? motion.t[0] : t);
    }
    const box = $("view").getBoundingClientRect();
    if (box.width !== width || box.height !== height) {
      [width, height] = [box.width, box.height];
      renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / Math.max(height, 1);
      // The model fits the narrower side.
      camera.fov = 2 * Math.atan(Math.tan(12.5 * Math.PI / 180) / Math.min(camera.aspect, 1)) * 180 / Math.PI;
      camera.updateProjectionMatrix();
      stale = true;
    }
    if (stale && motion) {
      stale = false;
      pose();
      $("scrub").value = state.t;
      $("time").textContent = `${state.t.toFixed(motion.unit === "s" ? 3 : 1)} ${motion.unit}`;
      plots.forEach(drawPlot);
      renderer.render(scene, camera);
    }
    requestAnimationFrame(frame);
  }

  // --- what is shown -----------------------------------------------------------------------------
  // A model as text: another one is built anew, the same one only moves otherwise.
  let built = "";
  function show(shown) {
    first = shown.view;
    state.hovered = -1;
    model = shown.model;
    motion = shown.motion;
    const problem = $("problem");
    if (!motion.complete && problem.hidden) {
      problem.hidden = false;
      problem.textContent = `The ${motion.unit === "s" ? "simulation" : "fold"} ended early: the motion ends at ${end()} ${motion.unit}.`;
    }
    const { extent, ground, walls, ...shape } = model;
    if (built !== JSON.stringify(shape)) {
      built = JSON.stringify(shape);
      build();
    }
    buildPlots();
    Object.assign($("scrub"), { min: motion.t[0], max: end() });
    go(state.t);
  }

  // --- live: what the server sends, and sliders that tell it what to try --------------------------
  let changed = { parameters: {}, initial: {} }, sending = false, unsent = false;

  async function send() {
    unsent = true;
    if (sending) return;
    sending = true;
    while (unsent) {
      unsent = false;
      await fetch("/set", { method: "POST", body: JSON.stringify(changed) }).catch(() => {});
    }
    sending = false;
  }

  function slider(name, doc, value, low, high, scale, unit, set) {
    const row = document.createElement("label");
    row.className = "slider";
    row.title = doc;
    const label = document.createElement("span");
    label.textContent = name;
    const told = document.createElement("output");
    const input = Object.assign(document.createElement("input"), { type: "range", step: "any", min: low, max: high, value });
    input.name = name;
    const tell = () => { told.textContent = `${Number((Number(input.value) * scale).toPrecision(4))}${unit}`; };
    tell();
    input.addEventListener("input", () => { tell(); set(Number(input.value)); send(); });
    row.append(label, told, input);
    return row;
  }

  function buildSliders({ parameters, initial }) {
    changed = { parameters: {}, initial: {} };
    const rows = parameters.map(({ name, value, doc }) => slider(
      name, doc, value, Math.min(0, 3 * value), Math.max(3 * value, 0) || 1, 1, "", (value) => { changed.parameters[name] = value; }));
    // The angles given pin the configuration together: all are sent once one is moved.
    const angles = Object.fromEntries(initial.map(({ joint, angle }) => [joint, angle]));
    rows.push(...initial.map(({ joint, angle, limits }) => slider(
      `${joint} at start`, "", angle, limits[0], limits[1], 180 / Math.PI, "\u00B0", (value) => { angles[joint] = value; changed.initial = { ...angles }; })));
    $("sliders").replaceChildren(...rows);
  }

  function take({ written, told, shown }) {
    const problem = $("problem");
    problem.hidden = !told;
    problem.textContent = told;
    if (!shown) return;
    if (written) {
      buildSliders(shown.controls);
      state.t = 0;
    }
    const began = motion !== undefined;
    show(shown);
    if (written || !began) play(end() > motion.t[0]);
  }

  async function listen() {
    let seen = 0;
    for (;;) {
      try {
        const answer = await fetch(`/next?after=${seen}`);
        if (answer.status === 200) {
          const message = await answer.json();
          seen = message.number;
          take(message);
          window.viewer.seen = seen;
        } else if (answer.status !== 204) {
          throw new Error(await answer.text());
        }
      } catch (error) {
        $("problem").hidden = false;
        $("problem").textContent = `lamc live does not answer: ${error.message}`;
        // A server that was started again counts from the beginning.
        seen = 0;
        await new Promise((done) => setTimeout(done, 500));
      }
    }
  }

  // For tests, and for the curious.
  window.viewer = { state, go, play, camera, bodies: () => bodies, hinges: () => hinges, bands: () => bands, arrows: () => arrows, motion: () => motion };
  if (data) {
    show(data);
    play(end() > motion.t[0]);
  } else {
    listen();
  }
  requestAnimationFrame(frame);
})();
