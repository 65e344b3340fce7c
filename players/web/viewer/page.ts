// One avatar and everything that acts on it. What wrote last wins: a slider pauses a clip, a clip ends live input.
import { Clip, Driver, isWeightsJson, parseLiveLinkCsv, parseWeightsJson, type Avatar, type Pose, type Recording, type Source } from "../src/index.js";
import { printable } from "../src/errors.js";
import { Saving } from "./stage/saving.js";
import { Alive } from "./motion/alive.js";
import { carryPose } from "./motion/carry.js";
import { ArkitInputs, arkitSection, expressionSection, jointSection, type ChannelSection } from "./controls/channels.js";
import { Clips, type Motion } from "./motion/clips.js";
import { byId, errorText, setText } from "./parts/dom.js";
import { listenForFiles } from "./parts/drop.js";
import { listenForKeys, showKeys } from "./parts/keys.js";
import { LightControls } from "./controls/light.js";
import { Live } from "./motion/live.js";
import { Loading } from "./parts/loading.js";
import { aboutSection, Look } from "./controls/look.js";
import { Messages } from "./parts/messages.js";
import { Panel } from "./controls/panel.js";
import { Presenting } from "./presenting.js";
import { recordingMotion } from "./motion/recording.js";
import { shareSection } from "./controls/share.js";
import { keysOf } from "./parts/shortcuts.js";
import { Stage } from "../src/stage/stage.js";
import { VisitorControls } from "./motion/visitor.js";
import type { Entry } from "./session.js";

const PANEL_EVERY_MS = 100; // values of sliders while things move
const NARROW = "(max-width: 719px)"; // as in viewer.css

/** How an avatar is opened. */
export interface Opening {
  readonly entry: Entry | null; // of the session; null: a file that a person opened
  readonly again: boolean; // the same avatar, made anew: pose, view and clip go on
}

/** The page around one avatar. */
export class Page {
  readonly messages = new Messages(byId("messages"));
  readonly stage: Stage;
  readonly ready: Promise<void>;
  readonly presenting = new Presenting();
  readonly alive: Alive;
  readonly visitor: VisitorControls;
  /** Called where an avatar's file changed on the server. */
  changed: (id: string) => void = () => undefined;

  private readonly clips = new Clips();
  private readonly loading = new Loading();
  private readonly look: Look;
  private readonly light: LightControls;
  private readonly panel: Panel;
  private readonly live: Live;
  private readonly saving: Saving;
  private inputs: ArkitInputs | null = null;
  private recordings: { name: string; recording: Recording }[] = [];
  private entry: Entry | null = null;
  private shownAt = 0;
  private resolve: () => void = () => undefined;
  private reject: (error: Error) => void = () => undefined;
  private awaited = false; // an avatar whose first picture is not there yet
  private fresh = false; // an avatar that did not move yet

  /** `moves`: an avatar with clips moves as soon as it is there, and presented it lives. */
  constructor(backend: "webgpu" | "webgl2" | undefined, private readonly moves: boolean) {
    this.ready = new Promise((resolve, reject) => {
      this.resolve = resolve;
      this.reject = reject;
    });
    this.ready.catch(() => undefined); // a message says it
    this.stage = new Stage(byId("stage"), backend, {
      seen: () => undefined,
      drawn: () => this.drawn(),
      awaiting: () => this.live.awaiting(),
      settled: () => this.settled(),
      lost: (reason) => this.lost(reason),
      failed: (error) => this.messages.error(errorText(error)),
    });
    this.look = new Look(this.stage);
    this.light = new LightControls(this.stage);
    this.saving = new Saving(this.stage, this.messages);
    this.panel = new Panel(byId("sections"), byId("search"), byId("found"), () => this.written());
    this.live = new Live(byId("live-state"), {
      changed: (id) => this.changed(id),
      message: (text) => this.messages.status(text),
      arrived: () => this.arrived(),
      posed: () => {
        this.stage.watched = true;
      },
    });
    this.visitor = new VisitorControls({
      inputs: () => this.inputs,
      began: () => this.written(),
      ended: () => this.resetPose(),
      ask: () => this.stage.ask(),
      note: (text) => this.messages.note(text),
      error: (text) => this.messages.error(text),
    });
    this.alive = new Alive(() => moves && this.presenting.on && !this.clips.playing && !this.followed);
    this.stage.movers.push(this.clips.move, this.live.move, this.alive.move);
    this.connect();
  }

  /** Loads and shows an avatar. Errors become messages, and what was shown before stays. */
  async open(source: Source, name: string, { entry, again }: Opening): Promise<void> {
    byId("empty").hidden = true;
    if (!again) this.loading.setPoster(entry?.preview ?? null);
    if (this.stage.avatar === null) setText(byId("name"), name);
    try {
      const avatar = await this.loading.load(source, name);
      if (avatar === null) {
        this.loading.hidePoster();
        if (this.stage.avatar === null) this.showEmpty();
        return;
      }
      if (!again && entry?.preview == null) this.loading.setPoster(avatar.preview);
      this.messages.clear();
      this.entry = entry;
      this.show(avatar, again);
    } catch (error) {
      if (this.stage.avatar !== null) this.loading.hidePoster();
      this.fail(errorText(error));
    }
  }

  /** Says what went wrong; where nothing was shown yet, nothing will be. */
  fail(text: string): void {
    this.messages.error(text);
    this.reject(new Error(text));
  }

  /** Says how to open an avatar. */
  showEmpty(): void {
    byId("empty").hidden = false;
  }

  /** Stops clips and the camera, while something else than the avatar is shown. */
  pause(): void {
    this.clips.pause();
    this.visitor.leave();
  }

  /** Listens to the server; `live`: motion may arrive. */
  listen(live: boolean): void {
    byId("live-button").hidden = !live;
    byId("live-state").hidden = !live;
    this.setFollow(live);
    this.live.connect();
  }

  /** Puts an avatar on the stage and fills the controls. With `again`, pose, view and clip go on. */
  private show(avatar: Avatar, again: boolean): void {
    const { avatar: before, pose: posed } = this.alive;
    const pose = this.alive.setAvatar(this.stage.show(avatar));
    if (again && before !== null && posed !== null) carryPose(before, posed, avatar, pose);
    this.awaited = true;
    this.inputs = this.inputsOf(avatar, pose);
    this.live.setAvatar(this.inputs);
    if (this.inputs === null) this.visitor.stop();
    this.stage.orbit.setFraming(avatar.framing, again);
    this.clips.setAvatar(this.motions(avatar), pose, again);
    if (avatar.expressions.length === 0 && !again && !this.followed) this.clips.seek(0); // a face begins at rest
    this.fresh = !again;
    this.fillPanel(avatar, pose);
    byId("frame-button").hidden = !this.stage.orbit.hasHead;
    const called = this.entry?.name ?? avatar.name;
    setText(byId("name"), called);
    document.title = printable(this.presenting.on ? called : `${called} · Avatar viewer`);
  }

  /** Whether live input or the visitor moves the avatar. */
  private get followed(): boolean {
    return this.live.follow || this.visitor.on;
  }

  /** After the first picture, which is what still pictures show, the first clip plays. */
  private begin(): void {
    if (!this.fresh || !this.moves || this.followed || this.clips.playing) return;
    this.fresh = false;
    this.alive.crossfade();
    this.clips.toggle();
  }

  /** A clip has ended: presented, the avatar lives on. */
  private ended(): void {
    if (!this.presenting.on) return;
    this.alive.crossfade();
    this.alive.pose?.reset();
  }

  private inputsOf(avatar: Avatar, pose: Pose): ArkitInputs | null {
    if (avatar.driving === null) return null;
    try {
      return new ArkitInputs(new Driver(avatar), pose);
    } catch (error) {
      this.messages.error(errorText(error)); // the avatar is shown all the same
      return null;
    }
  }

  private motions(avatar: Avatar): Motion[] {
    const clips: Motion[] = avatar.clips.map((_, i) => new Clip(avatar, i));
    const { inputs } = this;
    if (inputs === null) return clips;
    return [...clips, ...this.recordings.map(({ name, recording }) => recordingMotion(name, recording, inputs))];
  }

  private fillPanel(avatar: Avatar, pose: Pose): void {
    const sections = [expressionSection(avatar, pose), arkitSection(avatar, this.inputs), jointSection(avatar, pose)];
    this.panel.setSections(sections.filter((section): section is ChannelSection => section !== null));
    this.look.setAvatar(avatar);
    this.light.setAvatar(avatar);
    byId("sections").prepend(this.look.element, ...(avatar.relight === null ? [] : [this.light.element]));
    const share = this.entry === null ? null : shareSection(this.entry);
    byId("sections").append(...(share === null ? [] : [share]), aboutSection(avatar, this.stage.player?.backend ?? ""));
  }

  /** A slider was moved. */
  private written(): void {
    this.clips.pause();
    this.setFollow(false);
    this.stage.ask();
  }

  private setFollow(follow: boolean): void {
    this.live.follow = follow;
    byId("live-button").setAttribute("aria-pressed", String(follow));
    if (follow) this.clips.pause();
  }

  private arrived(): void {
    if (this.inputs === null && this.stage.avatar !== null) {
      this.messages.error(`${this.stage.avatar.name}: it has no ARKit driving, so live input cannot move it`);
    }
  }

  private record(name: string, text: string): void {
    const avatar = this.stage.avatar;
    if (avatar === null || this.inputs === null) {
      const why = avatar === null ? "open an avatar first" : `${avatar.name} has no ARKit driving, so a recording cannot move it`;
      this.messages.error(`${name}: ${why}`);
      return;
    }
    const recording = isWeightsJson(text) ? parseWeightsJson(text, name) : parseLiveLinkCsv(text, name);
    this.recordings = [...this.recordings.filter((old) => old.name !== name), { name, recording }];
    this.clips.add(recordingMotion(name, recording, this.inputs));
    this.messages.note(`${name} plays`);
  }

  private drawn(): void {
    this.light.showSun();
    const now = performance.now();
    if (now - this.shownAt < PANEL_EVERY_MS) return;
    this.showValues(now);
  }

  private settled(): void {
    this.live.shown();
    if (this.awaited && this.stage.instance !== null) {
      this.awaited = false;
      this.loading.hidePoster();
      this.begin();
      this.resolve();
    }
    this.showValues(performance.now());
  }

  private showValues(now: number): void {
    this.shownAt = now;
    if (byId("panel-button").getAttribute("aria-expanded") === "true") this.panel.show();
    const { player, frameMs } = this.stage;
    const time = frameMs > 0 ? ` · ${frameMs.toFixed(0)} ms` : "";
    setText(byId("numbers"), player === null ? "" : `${player.splats.toLocaleString("en")} splats${time}`);
  }

  private lost(reason: string): void {
    this.saving.stop();
    this.clips.pause();
    this.messages.error(`The graphics device was lost (${reason}). The last picture stays.`, {
      label: "Restart",
      run: () => void this.restart(),
    });
  }

  private async restart(): Promise<void> {
    try {
      await this.stage.restart();
      if (this.alive.avatar !== null) this.show(this.alive.avatar, true);
    } catch (error) {
      this.messages.error(errorText(error), { label: "Restart", run: () => void this.restart() });
    }
  }

  /** Buttons, files and keys. */
  private connect(): void {
    this.clips.changed = () => this.stage.ask();
    this.clips.started = () => {
      this.setFollow(false);
      this.visitor.stop();
    };
    this.clips.once = () => this.presenting.on && this.alive.lives;
    this.clips.ended = () => this.ended();
    this.presenting.changed = () => this.presented();
    this.live.ask = () => this.stage.ask();
    const press = (id: string, run: () => void): void => byId(id).addEventListener("click", run);
    press("frame-button", () => this.stage.orbit.toggle());
    press("live-button", () => this.setFollow(!this.live.follow));
    press("reset-button", () => this.resetPose());
    press("full-button", () => void this.toggleFullScreen());
    press("panel-button", () => this.showPanel(byId("panel-button").getAttribute("aria-expanded") === "false"));
    press("help-button", () => byId<HTMLDialogElement>("help").showModal());
    press("help-close", () => byId<HTMLDialogElement>("help").close());
    listenForFiles({
      avatar: (file) => this.open(file, file.name, { entry: null, again: false }),
      recording: (name, text) => this.record(name, text),
      failed: (error) => this.messages.error(errorText(error)),
    });
    const keys = keysOf({ orbit: this.stage.orbit, clips: this.clips, look: this.look, light: this.light });
    listenForKeys(keys);
    showKeys(byId("keys"), keys);
    this.showPanel(!matchMedia(NARROW).matches);
  }

  /** Opens with the avatar alone, or with its controls; `embedded`: in a frame of another page. */
  present(alone: boolean, embedded: boolean): void {
    if (alone) this.look.soft();
    if (embedded) this.stage.controls = "page";
    this.presenting.begin(alone, embedded);
  }

  /** The avatar alone fills the page, or its controls stand around it. */
  private presented(): void {
    if (!this.presenting.on) this.panel.show();
    this.stage.ask();
  }

  private resetPose(): void {
    this.inputs?.clear();
    this.alive.pose?.reset();
    this.written();
    this.panel.show();
  }

  private showPanel(shown: boolean): void {
    byId("viewer").classList.toggle("no-panel", !shown);
    byId("panel-button").setAttribute("aria-expanded", String(shown));
    if (shown) this.panel.show();
  }

  private async toggleFullScreen(): Promise<void> {
    try {
      if (document.fullscreenElement !== null) await document.exitFullscreen();
      else await document.documentElement.requestFullscreen();
    } catch {
      this.messages.note("This browser does not allow full screen here");
    }
  }
}
