// Chromium without a screen, and checks that say what they found.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

const FLAGS = [
  "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
  "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
];

export function check(what, holds, found = "") {
  if (!holds) throw new Error(`not so: ${what} ${JSON.stringify(found)}`);
  console.log(`ok: ${what}`);
}

// Runs `work` with an empty page in a browser of its own.
export async function open(options, work) {
  const profile = mkdtempSync(join(tmpdir(), "lamc-chromium-"));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: FLAGS,
    viewport: { width: 1200, height: 720 },
    ...options,
  });
  try {
    await work(context.pages()[0] ?? await context.newPage());
  } finally {
    await context.close();
    rmSync(profile, { recursive: true, force: true });
  }
}

// Runs `work` with the viewer at `url`; errors of the page, and requests that leave `origin`, fail.
export async function visit(url, origin, options, work) {
  await open(options, async (page) => {
    const problems = [];
    page.on("console", (message) => {
      if (message.type() === "error") problems.push(message.text());
    });
    page.on("pageerror", (error) => problems.push(String(error)));
    page.on("request", (request) => {
      if (!request.url().startsWith(origin)) problems.push(`asks for ${request.url()}`);
    });
    await page.goto(url);
    await page.waitForFunction(() => window.viewer !== undefined);
    await work(page);
    check("no errors, nothing fetched from elsewhere", problems.length === 0, problems);
  });
}
