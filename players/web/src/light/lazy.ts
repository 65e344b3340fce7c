// The code of light, which loads with the first pack that can be lit.

/** null: no such pack was loaded. */
export const LIGHT: { part: typeof import("./part.js") | null } = { part: null };

/** Resolves when `LIGHT.part` is there. */
export async function loadLight(): Promise<void> {
  LIGHT.part ??= await import("./part.js");
}
