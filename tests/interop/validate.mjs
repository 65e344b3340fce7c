// The Khronos glTF validator's full report on each of `files`.
import fs from "node:fs";
import validator from "gltf-validator";
import { answer, job } from "./job.mjs";

const reports = [];
for (const file of job.files) {
  reports.push(await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 0 }));
}
answer({ version: validator.version(), reports });
