// Models in an editor: node editor.mjs SCHEMA.json MODEL.yaml.. [--wrong MODEL.yaml..]
//
// yaml-language-server, which editors ask, gets each model with the schema named in its first line, as
// docs/MODEL.md says. It must find nothing in a model, and in a wrong one a mistake at the line of the first
// error in `MODEL.stderr`.
import { spawn } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, dirname, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const require = createRequire(import.meta.url);
const rpc = require("vscode-jsonrpc/node");
const program = require.resolve("yaml-language-server/bin/yaml-language-server");

// Errors and warnings; what the server only remarks, as an anchor that nothing uses, is no mistake.
const WARNING = 2;
const LONGEST_ANSWER = 60_000;

const [schema, ...paths] = process.argv.slice(2);
const wrongFrom = paths.indexOf("--wrong");
const models = wrongFrom < 0 ? paths : paths.slice(0, wrongFrom);
const wrong = wrongFrom < 0 ? [] : paths.slice(wrongFrom + 1);

const server = spawn(process.execPath, [program, "--stdio"], { stdio: ["pipe", "pipe", "inherit"] });
const connection = rpc.createMessageConnection(server.stdout, server.stdin);
// No schema comes from elsewhere.
const settings = { yaml: { validate: true, schemaStore: { enable: false } } };
const configured = new Promise((done) => {
  connection.onRequest("workspace/configuration", ({ items }) => {
    setImmediate(done);
    return items.map(({ section }) => settings[section] ?? null);
  });
});
connection.onRequest("client/registerCapability", () => null);
const answers = new Map();
connection.onNotification("textDocument/publishDiagnostics", ({ uri, diagnostics }) => answers.get(uri)?.(diagnostics));
connection.listen();

// The mistakes the server finds in a model, with their lines in the file.
async function mistakes(path) {
  const uri = pathToFileURL(resolve(dirname(schema), basename(path))).href;
  const text = `# yaml-language-server: $schema=${basename(schema)}\n${readFileSync(path, "utf8")}`;
  const answer = new Promise((done) => answers.set(uri, done));
  await connection.sendNotification("textDocument/didOpen", {
    textDocument: { uri, languageId: "yaml", version: 1, text },
  });
  const found = (await answer).filter(({ severity }) => severity <= WARNING);
  // The first line, counted from 0, names the schema.
  return found.map(({ range, message }) => ({ line: range.start.line, message }));
}

const late = setTimeout(() => {
  console.error("yaml-language-server does not answer");
  process.exit(1);
}, LONGEST_ANSWER);
await connection.sendRequest("initialize", {
  processId: process.pid,
  rootUri: null,
  capabilities: { workspace: { configuration: true } },
});
await connection.sendNotification("initialized", {});
await configured;

let failures = 0;
function check(path, isSound, found) {
  const told = found.map(({ line, message }) => `${line}: ${message.slice(0, 80)}`).join("; ") || "no mistakes";
  console.log(`${isSound ? "ok" : "FAILED"}: ${path}: ${told}`);
  if (!isSound) failures += 1;
}
for (const path of models) {
  const found = await mistakes(path);
  check(path, found.length === 0, found);
}
for (const path of wrong) {
  const report = readFileSync(path.replace(/yaml$/, "stderr"), "utf8");
  const line = Number(report.match(/^ *--> .*:(\d+):\d+$/m)[1]);
  const found = await mistakes(path);
  check(path, found.some((mistake) => mistake.line === line), found);
}
clearTimeout(late);
connection.dispose();
server.kill();
process.exit(failures === 0 && models.length + wrong.length > 0 ? 0 : 1);
