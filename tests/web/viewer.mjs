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

    const sample = Math.floor(motion.t.length / 3);
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
