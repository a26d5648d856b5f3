// Runs the motion of the WebAssembly module in one number type and prints the final state as JSON.
import { readFileSync } from "node:fs";

const [, , path, scalar] = process.argv;
const { instance } = await WebAssembly.instantiate(readFileSync(path));
const { memory, ...motions } = instance.exports;
const address = motions[`motion_${scalar}`]();
if (address === 0) throw new Error("the six-bar did not move");
const numbers = new BigUint64Array(memory.buffer, address, 12);
const coordinates = Array.from(numbers, (bits) => bits.toString(16).padStart(16, "0"));
console.log(JSON.stringify({ coordinates }));
