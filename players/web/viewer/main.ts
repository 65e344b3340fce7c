// The viewer page: starts it, and offers `window.avatarViewer` to tests and to pages that embed this one.
import type { Instance, Player, Pose } from "../src/index.js";
import { byId, errorText } from "./parts/dom.js";
import { Gallery } from "./gallery.js";
import { Page } from "./page.js";
import { EMPTY, readSession, sourceOf, type Entry, type Session } from "./session.js";

declare global {
  interface Window {
    /** For tests and for pages that embed the viewer. */
    avatarViewer: AvatarViewer;
  }
}

/** The viewer from outside. Call `draw` after changing `pose`. */
export interface AvatarViewer {
  /** null before the start and while the device is lost. */
  readonly player: Player | null;
  /** The avatar that is shown, or null. */
  readonly instance: Instance | null;
  /** Its pose before idle life, which clips and sliders write, too. */
  readonly pose: Pose | null;
  /** Resolves after the first picture; rejects where the first avatar cannot be shown. */
  readonly ready: Promise<void>;
  /** Frames drawn so far. */
  readonly frames: number;
  /** Asks for a frame. */
  draw(): void;
}

/** Follows the address: `?avatar=ID`, or the gallery where there are several avatars and none is asked for. */
class Navigation {
  private session: Session = EMPTY;
  private gallery: Gallery | null = null;
  private current: Entry | null = null;

  constructor(private readonly page: Page) {
    addEventListener("popstate", () => this.follow());
    byId("gallery-button").addEventListener("click", () => this.toGallery());
  }

  /** Reads the session and shows what the address asks for. */
  async start(): Promise<void> {
    await this.read();
    this.page.visitor.offer(this.session.talk);
    this.page.present(this.session.present, new URLSearchParams(location.search).has("embed"));
    this.follow();
    if (this.session.live || this.session.events) this.page.listen(this.session.live);
  }

  /** An avatar's file changed: the session is read again, and the avatar loaded again where it is shown. */
  async changed(id: string): Promise<void> {
    try {
      await this.read();
    } catch (error) {
      this.page.messages.error(errorText(error));
      return;
    }
    const entry = this.session.avatars.find((one) => one.id === id);
    if (entry !== undefined && this.current?.id === id) this.open(entry, true);
  }

  private async read(): Promise<void> {
    this.session = await readSession();
    const { avatars } = this.session;
    byId("gallery-button").hidden = avatars.length < 2 && this.session.gallery === null;
    const shown = this.gallery?.shown ?? false;
    this.gallery = new Gallery(avatars, (entry) => this.go(entry));
    this.gallery.shown = shown;
  }

  private toGallery(): void {
    if (this.session.gallery === null) this.go(null);
    else location.assign(this.session.gallery);
  }

  private go(entry: Entry | null): void {
    const address = entry === null ? location.pathname : `?avatar=${encodeURIComponent(entry.id)}`;
    try {
      history.pushState(null, "", address);
    } catch {
      // a page from a file may have no other address; what it shows changes all the same
    }
    this.show(entry);
  }

  private follow(): void {
    const { avatars } = this.session;
    const asked = new URLSearchParams(location.search).get("avatar");
    const found = avatars.find((entry) => entry.id === asked) ?? null;
    if (asked !== null && found === null) this.page.messages.error(`There is no avatar ${asked} here.`);
    this.show(found ?? (avatars.length === 1 ? (avatars[0] ?? null) : null));
  }

  private show(entry: Entry | null): void {
    const gallery = entry === null && this.session.avatars.length > 1;
    if (this.gallery !== null) this.gallery.shown = gallery;
    if (gallery) this.page.pause();
    else if (entry === null) this.page.showEmpty();
    else if (this.current?.id !== entry.id) this.open(entry, false);
  }

  private open(entry: Entry, again: boolean): void {
    this.current = entry;
    void this.page.open(sourceOf(entry), entry.name, { entry, again });
  }
}

function backendAsked(): "webgpu" | "webgl2" | undefined {
  const asked = new URLSearchParams(location.search).get("backend");
  return asked === "webgpu" || asked === "webgl2" ? asked : undefined;
}

/** Whoever asked the system for less motion, or the address for none, starts clips himself. */
function playAsked(): boolean {
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  return !still && new URLSearchParams(location.search).get("play") !== "0";
}

async function main(): Promise<void> {
  const page = new Page(backendAsked(), playAsked());
  const navigation = new Navigation(page);
  page.changed = (id) => void navigation.changed(id);
  window.avatarViewer = {
    get player() {
      return page.stage.player;
    },
    get instance() {
      return page.stage.instance;
    },
    get pose() {
      return page.alive.pose;
    },
    get frames() {
      return page.stage.frames;
    },
    ready: page.ready,
    draw: () => page.stage.ask(),
  };
  try {
    await page.stage.start();
    await navigation.start();
  } catch (error) {
    page.fail(errorText(error));
  }
}

void main();
