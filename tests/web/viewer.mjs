// The viewer page in a browser: node viewer.mjs PAGE.html [FOLDER for screenshots]
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { check, visit } from "./browser.mjs";

const url = pathToFileURL(resolve(process.argv[2])).href;
const folder = process.argv[3];
const time = (page) => page.evaluate(() => viewer.state.t);
const data = (page) => page.evaluate(() => JSON.parse(document.getElementById("data").textContent));
const settled = (page) => page.evaluate(() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(done))));

for (const colorScheme of ["light", "dark"]) {
  await visit(url, url, { colorScheme }, async (page) => {
    const { model, motion } = await data(page);
    const end = motion.t.at(-1);

    const before = await time(page);
    await page.waitForFunction((before) => viewer.state.t !== before, before);
    check("plays by itself", true);
    await page.keyboard.press("Space");
    const paused = await time(page);
    await page.waitForTimeout(300);
    check("space pauses", await time(page) === paused);

    // Before a sample at which something carries weight, if anything ever does.
    const loaded = motion.t.findIndex((_, sample) => sample > 0 && motion.forces.some((forces) => forces[3 * sample + 2] > 0));
    const sample = loaded > 0 ? loaded - 1 : Math.floor(motion.t.length / 3);
    await page.locator("#scrub").fill(String(motion.t[sample]));
    await settled(page);
    check("scrubs", await time(page) === motion.t[sample]);
    const placed = await page.evaluate(() => viewer.bodies().map((body) =>
      [...body.quaternion.toArray(), ...body.position.toArray()]));
    const away = Math.max(...placed.flatMap((pose, body) => pose.map((number, index) =>
      Math.abs(Math.abs(number) - Math.abs(motion.poses[body][7 * sample + index])))));
    check("bodies stand as recorded", away < 1e-6, away);
    await page.locator("body").click({ position: { x: 2, y: 2 } });
    await page.keyboard.press("ArrowRight");
    check("an arrow steps by a sample", Math.abs(await time(page) - motion.t[sample + 1]) < 1e-9);

    await settled(page);
    // Springs end at their points. Arrows start at contact points, and are as long as the legend says.
    const { ends, arrows } = await page.evaluate(() => ({
      ends: viewer.bands().map(({ rods }) => [-0.5, 0.5].map((end, side) => {
        const rod = side ? rods.at(-1) : rods[0];
        rod.updateMatrixWorld();
        return rod.position.clone().set(0, end, 0).applyMatrix4(rod.matrixWorld).toArray();
      })),
      arrows: viewer.arrows().map((arrow) => {
        const up = arrow.position.clone().set(0, 1, 0).applyQuaternion(arrow.quaternion);
        return { visible: arrow.visible, from: arrow.position.toArray(), to: up.toArray(), length: arrow.line.scale.y + arrow.cone.scale.y };
      }),
    }));
    const at = sample + 1;
    const placedAt = ({ body, at: [x, y, z] }) => {
      const [i, j, k, w, ...p] = motion.poses[body].slice(7 * at, 7 * at + 7);
      const [s, t, u] = [2 * (j * z - k * y), 2 * (k * x - i * z), 2 * (i * y - j * x)];
      return [x + w * s + j * u - k * t + p[0], y + w * t + k * s - i * u + p[1], z + w * u + i * t - j * s + p[2]];
    };
    const apart = (a, b) => Math.hypot(...a.map((part, axis) => part - b[axis]));
    model.bands.forEach(({ name, through }, band) => [through[0], through.at(-1)].forEach((point, side) => {
      const error = apart(ends[band][side], placedAt(model.points[point]));
      check(`${name} ends at its point`, error < 1e-6, error);
    }));
    let seenForces = 0;
    arrows.forEach(({ visible, from, to, length }, contact) => {
      const force = motion.forces[contact].slice(3 * at, 3 * at + 3);
      const expected = Math.hypot(...force) * (model.scale?.length ?? 0) / (model.scale?.force ?? 1);
      check(`${model.contacts[contact].name} has an arrow if there is a force`, visible === expected > 1e-3 * model.size, expected);
      if (!visible) return;
      seenForces++;
      const error = apart(from, placedAt(model.contacts[contact])) + Math.abs(length - expected)
        + length * apart(to, force.map((part) => part / Math.hypot(...force)));
      check("its arrow shows it", error < 1e-6, error);
    });
    check("some contact carries a force", seenForces > 0 || model.contacts.length === 0);
    const legend = await page.locator("#legend").textContent();
    check("the scale of forces is stated", !model.scale || legend.includes(model.scale.label), legend);

    // A hinge in the picture: its name appears where the mouse points at it.
    await page.evaluate(() => { viewer.go(0); });
    await settled(page);
    const named = new Set();
    for (const [joint, hinge] of model.hinges.entries()) {
      for (const share of [0.5, 0.85]) {
        const [x, y] = await page.evaluate(([joint, ends, share]) => {
          const body = viewer.bodies()[viewer.hinges().indexOf(viewer.hinges()[joint])] && viewer.hinges()[joint].line.parent;
          const [a, b] = ends;
          const at = viewer.camera.position.clone().set(...a.map((from, axis) => from + share * (b[axis] - from)));
          at.applyMatrix4(body.matrixWorld).project(viewer.camera);
          const box = document.getElementById("model").getBoundingClientRect();
          return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
        }, [joint, hinge.ends, share]);
        await page.mouse.move(x, y);
        const tip = page.locator("#tip");
        if (await tip.isVisible()) named.add((await tip.textContent()).split(/\s/)[0]);
      }
    }
    check("hinges tell their names", named.size === model.hinges.length, [...named]);

    // A curve of a plot: likewise, and a click there sets the time.
    const plot = await page.locator(".plot").first().boundingBox();
    await page.mouse.click(plot.x + 46 + (plot.width - 54) / 2, plot.y + plot.height / 2);
    await settled(page);
    check("a click in a plot sets the time", Math.abs(await time(page) - end / 2) < 0.02 * end, await time(page));
    const found = new Set();
    for (let y = 8; y < plot.height - 22; y += 2) {
      await page.mouse.move(plot.x + 60, plot.y + y);
      if (await page.locator("#tip").isVisible()) {
        found.add((await page.locator("#tip").textContent()).split(/\s/)[0]);
      }
    }
    check("curves tell their names", found.size > 0 && [...found].every((name) => motion.joints.includes(name)), [...found]);

    // The picture shows the model: its colours are there.
    await page.mouse.move(2, 2);
    const seen = await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => {
      viewer.go(viewer.state.t);
      requestAnimationFrame(() => {
        const model = document.getElementById("model");
        const copy = Object.assign(document.createElement("canvas"), { width: 200, height: 150 });
        const pen = copy.getContext("2d");
        pen.drawImage(model, 0, 0, 200, 150);
        const { data } = pen.getImageData(0, 0, 200, 150);
        let opaque = 0;
        for (let at = 3; at < data.length; at += 4) opaque += data[at] > 200;
        done(opaque / (200 * 150));
      });
    })));
    check("a good part of the view is model", seen > 0.05, seen);
    if (folder) await page.screenshot({ path: join(folder, `viewer-${colorScheme}.png`) });
  });
}
