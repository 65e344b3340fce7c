/** The lights that have names, which the commands have too; bundle.mjs knows where they lie. */
declare module "light-presets:" {
  const presets: Readonly<Record<string, import("./light.js").Light>>;
  export default presets;
}
