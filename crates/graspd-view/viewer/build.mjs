// Bundles src/main.ts with the parts of three and fflate that it uses into one script: `node build.mjs OUTPUT`.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const output = process.argv[2] ?? "viewer.js";
const { outputFiles, metafile } = await build({
  entryPoints: ["src/main.ts"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2021",
  charset: "ascii",
  legalComments: "none",
  metafile: true,
  write: false,
});

// Of which sources: a test compares this with the files, where no bundler is at hand.
const digest = createHash("sha256");
const sources = readdirSync("src").sort().map((name) => `src/${name}`);
for (const name of ["build.mjs", "package-lock.json", ...sources]) {
  const text = readFileSync(name);
  digest.update(`${name} ${text.length}\n`);
  digest.update(text);
}

const packages = new Set(
  Object.keys(metafile.inputs).filter((path) => path.startsWith("node_modules/")).map((path) => path.split("/")[1]),
);
const notices = [...packages].sort().map((name) => {
  const { version, license } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  const notice = readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim().replaceAll("*/", "* /");
  return `${name} ${version} (${license})\n\n${notice}`;
});
const banner = `/*! The viewer of graspd, bundled by crates/graspd-view/viewer/build.mjs; not edited by hand.
sources sha256:${digest.digest("hex")}

It holds parts of:

${notices.join("\n\n----\n\n")}
*/
`;
writeFileSync(output, banner + outputFiles[0].text);
