// A video in a browser: node video.mjs VIDEO.mp4 SECONDS WIDTH HEIGHT
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { check, open } from "./browser.mjs";

const [path, seconds, width, height] = process.argv.slice(2);
await open({}, async (page) => {
  await page.goto(pathToFileURL(resolve(path)).href);
  const played = await page.evaluate(async () => {
    const video = document.querySelector("video");
    video.muted = true;
    video.playbackRate = 4;
    const ended = new Promise((done, fail) => { video.onended = done; video.onerror = () => fail(video.error); });
    await video.play();
    await ended;
    const { duration, currentTime, videoWidth, videoHeight } = video;
    return { duration, currentTime, videoWidth, videoHeight };
  });
  check("plays to its end", played.currentTime === played.duration, played);
  check("lasts as long as it should", Math.abs(played.duration - seconds) < 0.05, played);
  check("has the size asked for", played.videoWidth === Number(width) && played.videoHeight === Number(height), played);
});
