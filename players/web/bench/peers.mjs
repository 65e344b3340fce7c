// Other renderers, pinned, in a folder that git ignores. They are no dependencies of the package.
import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdir, writeFile } from "node:fs/promises";
import { join } from "node:path";

const PEERS = {
  "@mkkellogg/gaussian-splats-3d": "0.4.7",
  "@sparkjsdev/spark": "2.2.0",
  "gaussian-splat-renderer-for-lam": "0.0.8",
  gsplat: "1.2.9",
  playcanvas: "2.23.3",
  three: "0.187.0",
};

/** Installs the peers into `folder`. */
export async function installPeers(folder) {
  const modules = join(folder, "node_modules");
  await mkdir(folder, { recursive: true });
  await writeFile(join(folder, "package.json"), JSON.stringify({ private: true, dependencies: PEERS }, null, 2));
  if (!Object.keys(PEERS).every((name) => existsSync(join(modules, name, "package.json")))) {
    execFileSync("npm", ["install", "--no-audit", "--no-fund", "--ignore-scripts"], { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
  }
}
