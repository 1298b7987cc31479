// Builds the page of `e2efly export RUN --web DIR` into the Python package.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

// index.html and page.css need no building: they stand there
const OUT = "../src/e2efly/viewing/web/assets";
const RUNTIME = "node_modules/onnxruntime-web/dist/ort-wasm-simd-threaded.wasm";

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
  banner: { js: `// Built from the sources in web/, ${digest()}; licenses.txt has the licences of what it contains.` },
  // ONNX Runtime asks where it was loaded from, for files that it does not load here
  define: { "import.meta.url": "document.baseURI" },
  logLevel: "warning",
});
const mit = readFileSync("node_modules/three/LICENSE", "utf8");
const terms = mit.slice(mit.indexOf("Permission is hereby granted"));
const holders = { "three.js": /Copyright.*/.exec(mit)?.[0], "ONNX Runtime": "Copyright (c) Microsoft Corporation" };
const notices = Object.entries(holders).map(([name, holder]) => `${name}, The MIT License\n${holder}\n\n${terms}`);
writeFileSync(`${OUT}/licenses.txt`, notices.join("\n"));
writeFileSync(`${OUT}/runtime.wasm.gz`, gzipSync(readFileSync(RUNTIME), { level: 9 }));
