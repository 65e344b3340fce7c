// What functions of src/ allocate, by V8's sampling of allocations; and the heap that is left after a collection.

const INTERVAL = 64; // bytes between samples, on average: every object of a loop of frames is seen

/** Bytes of JavaScript that live after a collection. `client` is the protocol session of a page or a worker. */
export async function liveBytes(client) {
  for (let i = 0; i < 2; i++) await client.send("HeapProfiler.collectGarbage");
  return (await client.send("Runtime.getHeapUsage")).usedSize;
}

/** Runs `run`; returns {"src/FILE.ts FUNCTION": bytes} of all that was allocated, also what was collected since. */
export async function allocated(client, script, run) {
  const files = filesOfLines(script);
  await client.send("HeapProfiler.startSampling", {
    samplingInterval: INTERVAL, includeObjectsCollectedByMajorGC: true, includeObjectsCollectedByMinorGC: true,
  });
  await run();
  const { profile } = await client.send("HeapProfiler.stopSampling");
  const found = {};
  const walk = ({ callFrame, selfSize, children }) => {
    const file = callFrame.url ? files[callFrame.lineNumber] : undefined;
    const name = `${file ?? "?"} ${callFrame.functionName || "(anonymous)"}:${callFrame.lineNumber}`;
    if (selfSize > 0) found[name] = (found[name] ?? 0) + selfSize;
    children.forEach(walk);
  };
  walk(profile.head);
  return found;
}

/** The source of each line of a bundle, by the comments that esbuild writes before each file. */
function filesOfLines(script) {
  let file;
  return script.split("\n").map((line) => (file = /^ *\/\/ (\S+\.ts)$/.exec(line)?.[1] ?? file));
}
