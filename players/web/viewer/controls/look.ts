// The section "View" of the panel: background and level of detail; and "About": facts, licence and consent.
import type { Avatar, Background } from "../../src/index.js";
import { bytesText, make } from "../parts/dom.js";
import type { Stage } from "../../src/stage/stage.js";

const NAMED: readonly (readonly [string, Background])[] = [
  ["Dark", [0.09, 0.09, 0.1]],
  ["Black", [0, 0, 0]],
  ["Grey", [0.5, 0.5, 0.5]],
  ["White", [1, 1, 1]],
  ["Transparent", null],
];
const OF_THE_AVATAR = "As trained";
const SOFT = "Soft"; // a glow behind the avatar, of the colour that it was trained over
const OTHER = "Colour …";

/** Choice of background and level. */
export class Look {
  readonly element: HTMLDetailsElement;
  private readonly background = make("select", { id: "background" });
  private readonly colour = make("input", { type: "color", value: "#336699", "aria-label": "Background colour", hidden: true });
  private readonly level = make("select", { id: "level" });
  private trained: Background = null;
  private wanted = OF_THE_AVATAR; // before a person chose
  private readonly levelRow: HTMLElement;

  constructor(private readonly stage: Stage) {
    this.levelRow = make("label", { class: "row choice" }, make("span", {}, "Detail"), this.level);
    this.element = make(
      "details",
      { class: "section", open: true },
      make("summary", {}, make("span", {}, "View")),
      make("label", { class: "row choice" }, make("span", {}, "Background"), this.background),
      make("div", { class: "row choice" }, make("span", {}), this.colour),
      this.levelRow,
    );
    this.background.addEventListener("change", () => this.apply());
    this.colour.addEventListener("input", () => this.apply());
    this.level.addEventListener("change", () => {
      const value = this.level.value;
      stage.level = value === "" ? null : Number(value);
      stage.ask();
    });
  }

  /** Offers what this avatar has. */
  setAvatar(avatar: Avatar): void {
    const chosen = this.background.value || this.wanted;
    this.trained = avatar.background;
    const names = [...(this.trained === null ? [] : [OF_THE_AVATAR]), SOFT, ...NAMED.map(([name]) => name), OTHER];
    this.background.replaceChildren(...names.map((name) => make("option", {}, name)));
    this.background.value = names.includes(chosen) ? chosen : (names[0] ?? OTHER);
    this.apply();
    const options = avatar.levels.map((level, i) => {
      const quality = level.psnrDb === null ? "" : `, ${level.psnrDb.toFixed(1)} dB`;
      return make("option", { value: i }, `${level.count.toLocaleString("en")} Gaussians${quality}`);
    });
    this.level.replaceChildren(make("option", { value: "" }, "Automatic"), ...options);
    this.levelRow.hidden = avatar.levels.length < 2;
    this.stage.level = null;
  }

  /** Begins with the soft background. */
  soft(): void {
    this.wanted = SOFT;
  }

  /** The next background of the list. */
  next(): void {
    this.background.selectedIndex = (this.background.selectedIndex + 1) % this.background.options.length;
    this.apply();
  }

  private apply(): void {
    const name = this.background.value;
    const other = name === OTHER;
    this.colour.hidden = !other;
    let colour: Background = NAMED.find(([known]) => known === name)?.[1] ?? null;
    if (name === OF_THE_AVATAR) colour = this.trained;
    if (other) colour = [1, 3, 5].map((at) => Number.parseInt(this.colour.value.slice(at, at + 2), 16) / 255) as unknown as Background;
    this.stage.background = colour;
    const { classList, style } = document.documentElement;
    const ground = name === SOFT ? this.trained : colour;
    if (ground === null) style.removeProperty("--stage");
    else style.setProperty("--stage", `rgb(${ground.map((part) => Math.round(part * 255)).join(" ")})`);
    classList.toggle("soft", name === SOFT);
    classList.toggle("checker", name !== SOFT && colour === null);
  }
}

/** Facts that a person may want to know before using an avatar. */
export function aboutSection(avatar: Avatar, backend: string): HTMLElement {
  const facts: [string, string][] = [
    ["Name", avatar.name],
    ["Licence", avatar.license ?? "not stated"],
    ["Consent", avatar.consent ?? "not stated"],
    ["File", bytesText(avatar.bytes)],
    ["Gaussians", (avatar.levels[0]?.count ?? 0).toLocaleString("en")],
    ["Expressions", String(avatar.expressions.length)],
    ["Joints", String(avatar.skeleton?.names.length ?? 0)],
    ["Clips", String(avatar.clips.length)],
    ["ARKit", avatar.driving === null ? "cannot drive it" : "drives it"],
    ["Drawn by", backend === "webgpu" ? "WebGPU" : "WebGL2"],
  ];
  const list = make("dl", {});
  for (const [name, text] of facts) list.append(make("dt", {}, name), make("dd", {}, text));
  return make("details", { class: "section", id: "about" }, make("summary", {}, make("span", {}, "About")), list);
}
