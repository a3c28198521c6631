// Bundles the page: node build.mjs [--output DIR=dist] [--modules DIR=node_modules]
import { copyFile, mkdir, readFile, rm, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { gzipSync } from 'node:zlib';

const here = dirname(fileURLToPath(import.meta.url));
const { values: options } = parseArgs({
  options: { output: { type: 'string', default: join(here, 'dist') }, modules: { type: 'string', default: join(here, 'node_modules') } },
});
const modules = resolve(options.modules);
const { build } = createRequire(join(modules, 'any.js'))('esbuild');
const output = resolve(options.output);
const assets = join(output, 'assets');

await rm(assets, { recursive: true, force: true });
await mkdir(assets, { recursive: true });
await build({
  entryPoints: {
    page: join(here, 'src/main.js'), style: join(here, 'src/page.css'), phone: join(here, 'src/phone/main.js'), phone_style: join(here, 'src/phone/phone.css'),
  },
  nodePaths: [modules],
  bundle: true,
  format: 'esm',
  minify: true,
  legalComments: 'eof',
  target: ['chrome111', 'firefox114', 'safari16.4'],
  outdir: assets,
  entryNames: '[name]',
  logLevel: 'warning',
});
await copyFile(join(here, 'src/icon.svg'), join(assets, 'icon.svg'));
await copyFile(join(here, 'src/index.html'), join(output, 'index.html'));

await copyFile(join(here, 'src/phone/phone.html'), join(output, 'phone.html'));
await copyFile(join(here, 'src/phone/worker.js'), join(output, 'phone_worker.js'));

// The server gives NAME.gz to who takes it.
const loads = {
  'the view': ['index.html', 'assets/page.js', 'assets/style.css', 'assets/icon.svg'],
  'the phone': ['phone.html', 'assets/phone.js', 'assets/phone_style.css', 'assets/icon.svg'],
};
for (const [what, names] of Object.entries(loads)) {
  let sum = 0;
  for (const name of names) {
    const bytes = await readFile(join(output, name));
    const packed = gzipSync(bytes, { level: 9 });
    await writeFile(join(output, `${name}.gz`), packed);
    sum += packed.length;
    console.log(`${name.padEnd(22)} ${String(bytes.length).padStart(8)} bytes, ${String(packed.length).padStart(7)} gzipped`);
  }
  console.log(`${`first load of ${what}`.padEnd(22)} ${' '.repeat(16)}${String(sum).padStart(7)} gzipped`);
}
