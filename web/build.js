// Builds the page of `e2efly export RUN --web DIR` into the Python package.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

// index.html and page.css need no building: they stand there
const OUT = "../src/e2efly/viewing/web/assets";

/** Hash of all that the page is built from, by which a test knows that it was built from what is here. */
function digest() {
  const names = readdirSync("src", { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => `${entry.parentPath}/${entry.name}`);
  const hash = createHash("sha256");
  for (const name of ["build.js", "package-lock.json", "package.json", ...names].sort()) {
    hash.update(`${name}\0${readFileSync(name, "utf8")}\0`);
  }
  return hash.digest("hex");
}

await build({
  entryPoints: ["src/main.js"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "none",
  outfile: `${OUT}/page.js`,
  banner: { js: `// Built from the sources in web/, ${digest()}; licenses.txt has the licence of three.js, which it contains.` },
  logLevel: "warning",
});
const licence = readFileSync("node_modules/three/LICENSE", "utf8").trim();
writeFileSync(`${OUT}/licenses.txt`, `three.js\n\n${licence}\n`);
