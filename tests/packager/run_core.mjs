// node run_core.mjs JOB.json: runs models in the library for web pages, as the page does, and prints the values that were read.
// JOB: {core, library, models: [{guid, files, read, starts: [{references, values}], steps, size}]}; a start that fails gives null.
import { readFileSync } from "node:fs";

const job = JSON.parse(readFileSync(process.argv[2], "utf8"));
const Core = new Function(`"use strict"; ${readFileSync(job.core, "utf8")}; return Core;`)();
const library = readFileSync(job.library), results = [];
for (const { guid, files, read, starts, steps, size } of job.models) {
  const core = await Core.load(library, Object.fromEntries(Object.entries(files).map(([name, path]) => [name, readFileSync(path)])), guid);
  const outputs = core.list(read);
  results.push(starts.map(({ references, values }) => {
    try {
      if (references.length) core.write(core.list(references), values);
      core.initialise(0);
      const rows = [[...core.read(outputs)]], began = performance.now();
      for (let k = 0; k < steps; k++) core.step(k * size, size);
      const seconds = (performance.now() - began) / 1000;
      rows.push([...core.read(outputs)]);
      return { rows, seconds };
    } catch (error) {
      return { error: error.message };
    } finally {
      core.reset();
    }
  }));
}
console.log(JSON.stringify(results));
