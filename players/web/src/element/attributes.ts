// The attributes of the element, and the properties that are the same.

/** Attributes by the name of their property. */
const TEXTS = { src: "src", poster: "poster", clip: "clip", idle: "idle", look: "look", level: "level", light: "light", alt: "alt", backend: "backend" };
const SWITCHES = { autoplay: "autoplay", cameraControls: "camera-controls" };

export const PROPERTIES: readonly string[] = [...Object.keys(TEXTS), ...Object.keys(SWITCHES)];
export const OBSERVED: readonly string[] = [...Object.values(TEXTS), ...Object.values(SWITCHES)];

/** Gives a class the properties: texts, null where there is no attribute, and booleans. */
export function defineProperties(prototype: HTMLElement): void {
  const define = <T>(name: string, get: (this: HTMLElement) => T, set: (this: HTMLElement, value: unknown) => void): void =>
    void Object.defineProperty(prototype, name, { configurable: true, enumerable: true, get, set });
  for (const [name, attribute] of Object.entries(TEXTS)) {
    define(
      name,
      function () {
        return this.getAttribute(attribute);
      },
      function (value) {
        if (value === null || value === undefined) this.removeAttribute(attribute);
        else this.setAttribute(attribute, String(value));
      },
    );
  }
  for (const [name, attribute] of Object.entries(SWITCHES)) {
    define(
      name,
      function () {
        return this.hasAttribute(attribute);
      },
      function (value) {
        this.toggleAttribute(attribute, Boolean(value));
      },
    );
  }
}
