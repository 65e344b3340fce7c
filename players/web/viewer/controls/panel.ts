// The panel of sliders with search, groups and reset. Native elements rather than a library of controls: of those, none
// that is small has both a search and sliders that a keyboard and a screen reader can work (lil-gui 0.21 draws its
// sliders as plain boxes without a role or a focus); a range input and <details> bring all of that.
import type { Channel, ChannelGroup, ChannelSection } from "./channels.js";
import { make, setText } from "../parts/dom.js";
import { printable } from "../../src/errors.js";

/** A slider with its label and value. */
class Row {
  readonly element: HTMLElement;
  readonly words: string;
  private readonly input: HTMLInputElement;
  private readonly output: HTMLOutputElement;
  private shown = Number.NaN;
  private readonly digits: number;

  constructor(
    private readonly channel: Channel,
    group: string,
    private readonly written: () => void,
  ) {
    this.words = `${group} ${channel.label}`.toLowerCase();
    this.digits = Math.max(0, Math.min(4, -Math.floor(Math.log10(channel.step) + 1e-9)));
    const { low, high, step, label } = channel;
    this.input = make("input", { type: "range", min: low, max: high, step });
    this.input.setAttribute("aria-label", printable(label.length > 1 ? label : `${group} ${label}`));
    this.output = make("output");
    this.element = make("label", { class: "row" }, make("span", { title: printable(label) }, label), this.input, this.output);
    this.input.addEventListener("input", () => this.set(this.input.valueAsNumber));
    this.element.addEventListener("dblclick", () => this.set(0));
    this.input.addEventListener("keydown", (event) => {
      if (event.key !== "Backspace" && event.key !== "Delete") return;
      event.stopPropagation();
      this.set(0);
    });
    this.show();
  }

  private set(value: number): void {
    this.channel.write(Math.min(this.channel.high, Math.max(this.channel.low, value)));
    this.show();
    this.written();
  }

  /** Shows the channel's value, if it changed. */
  show(): void {
    const value = this.channel.read();
    if (value === this.shown) return;
    this.shown = value;
    if (Math.abs(value - this.input.valueAsNumber) >= this.channel.step / 2) this.input.value = String(value);
    const text = value.toFixed(this.digits).replace(/^-(0\.?0*)$/, "$1") + this.channel.unit;
    setText(this.output, text);
    this.input.setAttribute("aria-valuetext", text);
  }
}

/** A group of rows, made when it is first opened. */
class Group {
  readonly element: HTMLDetailsElement;
  private rows: Row[] | null = null;
  private openBefore = false;

  constructor(
    private readonly group: ChannelGroup,
    open: boolean,
    private readonly written: () => void,
  ) {
    this.element = make("details", { class: "group" }, make("summary", {}, group.title));
    this.element.addEventListener("toggle", () => {
      if (this.element.open) this.show();
    });
    this.element.open = open;
    this.openBefore = open;
  }

  /** Shows the values, if anybody can see them. */
  show(): void {
    if (!this.element.open || this.element.hidden) return;
    for (const row of this.made()) row.show();
  }

  private made(): Row[] {
    if (this.rows === null) {
      this.rows = this.group.make().map((channel) => new Row(channel, this.group.title, this.written));
      this.element.append(...this.rows.map((row) => row.element));
    }
    return this.rows;
  }

  /** Hides what does not match; "" shows everything again. Returns how many rows are found. */
  filter(words: string, inTitle: boolean, wasSearching: boolean): number {
    if (words === "") {
      if (wasSearching) this.element.open = this.openBefore;
      for (const row of this.rows ?? []) row.element.hidden = false;
      this.element.hidden = false;
      return 0;
    }
    if (!wasSearching) this.openBefore = this.element.open;
    const title = inTitle || this.group.title.toLowerCase().includes(words);
    if (!title && !this.group.words.includes(words)) {
      this.element.hidden = true;
      return 0;
    }
    let found = 0;
    for (const row of this.made()) {
      const match = title || row.words.includes(words);
      row.element.hidden = !match;
      if (match) found++;
    }
    this.element.hidden = found === 0;
    this.element.open = found > 0;
    this.show();
    return found;
  }
}

/** One section, such as "Expressions". */
class Section {
  readonly element: HTMLDetailsElement;
  private readonly groups: Group[];
  private openBefore: boolean;

  constructor(section: ChannelSection, open: boolean, written: () => void) {
    const reset = make("button", { class: "text reset", "aria-label": `Reset ${section.title}` }, "Reset");
    reset.addEventListener("click", () => {
      section.reset();
      written();
    });
    this.element = make("details", { class: "section sliders" }, make("summary", {}, make("span", {}, section.title)), reset);
    const alone = section.groups.length === 1;
    this.groups = section.groups.map((group, i) => new Group(group, i === 0, written));
    if (alone) this.element.classList.add("alone");
    this.element.append(...this.groups.map((group) => group.element));
    this.element.addEventListener("toggle", () => this.show());
    this.element.open = open;
    this.openBefore = open;
  }

  show(): void {
    if (!this.element.open) return;
    for (const group of this.groups) group.show();
  }

  filter(words: string, wasSearching: boolean): number {
    if (words !== "" && !wasSearching) this.openBefore = this.element.open;
    if (words === "" && wasSearching) this.element.open = this.openBefore;
    const title = (this.element.querySelector("summary span")?.textContent ?? "").toLowerCase();
    let found = 0;
    for (const group of this.groups) found += group.filter(words, words !== "" && title === words, wasSearching);
    if (words !== "") this.element.open = found > 0;
    this.element.hidden = words !== "" && found === 0;
    return found;
  }
}

/** All sections of sliders of one avatar. */
export class Panel {
  private sections: Section[] = [];
  private searched = "";

  constructor(
    private readonly parent: HTMLElement,
    private readonly search: HTMLInputElement,
    private readonly found: HTMLElement,
    private readonly written: () => void,
  ) {
    search.addEventListener("input", () => this.filter(search.value));
  }

  /** Shows other sections; the first one is open. */
  setSections(sections: readonly ChannelSection[]): void {
    const written = (): void => {
      this.written();
      this.show(); // one slider may move others
    };
    this.sections = sections.map((section, i) => new Section(section, i === 0, written));
    this.parent.replaceChildren(...this.sections.map((section) => section.element));
    this.searched = "";
    this.filter(this.search.value);
  }

  /** Shows the values of what is open. */
  show(): void {
    for (let i = 0; i < this.sections.length; i++) this.sections[i]!.show();
  }

  private filter(text: string): void {
    const words = text.trim().toLowerCase();
    let found = 0;
    for (const section of this.sections) found += section.filter(words, this.searched !== "");
    this.searched = words;
    this.parent.classList.toggle("searching", words !== "");
    setText(this.found, words === "" ? "" : found === 0 ? "Nothing found" : `${found} found`);
  }
}
