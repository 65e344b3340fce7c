// One avatar and everything that acts on it. What wrote last wins: a slider pauses a clip, a clip ends live input.
import { Clip, Driver, parseLiveLinkCsv, type Avatar, type Instance, type Pose, type Recording, type Source } from "../src/index.js";
import { printable } from "../src/errors.js";
import { takePicture, Video } from "./stage/capture.js";
import { carryPose } from "./motion/carry.js";
import { ArkitInputs, arkitSection, expressionSection, jointSection, type ChannelSection } from "./controls/channels.js";
import { Clips, type Motion } from "./motion/clips.js";
import { byId, errorText, setText } from "./parts/dom.js";
import { listenForFiles } from "./parts/drop.js";
import { listenForKeys, showKeys } from "./parts/keys.js";
import { Live } from "./motion/live.js";
import { Loading } from "./parts/loading.js";
import { aboutSection, Look } from "./controls/look.js";
import { Messages } from "./parts/messages.js";
import { Panel } from "./controls/panel.js";
import { recordingMotion } from "./motion/recording.js";
import { keysOf } from "./parts/shortcuts.js";
import { Stage } from "./stage/stage.js";

const PANEL_EVERY_MS = 100; // values of sliders while things move
const NARROW = "(max-width: 719px)"; // as in viewer.css

/** How an avatar is opened. */
export interface Opening {
  readonly preview: string | null; // address of a still picture
  readonly again: boolean; // the same avatar, made anew: pose, view and clip go on
  readonly called: string | null; // its name on the page; null: its own
}

/** The page around one avatar. */
export class Page {
  readonly messages = new Messages(byId("messages"));
  readonly stage: Stage;
  readonly ready: Promise<void>;
  /** Called where an avatar's file changed on the server. */
  changed: (id: string) => void = () => undefined;

  private readonly clips = new Clips();
  private readonly loading = new Loading();
  private readonly look: Look;
  private readonly panel: Panel;
  private readonly live: Live;
  private readonly video: Video;
  private inputs: ArkitInputs | null = null;
  private recordings: { name: string; recording: Recording }[] = [];
  private called = ""; // the name that the page shows
  private shownAt = 0;
  private resolve: () => void = () => undefined;
  private reject: (error: Error) => void = () => undefined;
  private awaited = false; // an avatar whose first picture is not there yet

  /** `play`: an avatar with clips moves as soon as it is there. */
  constructor(backend: "webgpu" | "webgl2" | undefined, private readonly play: boolean) {
    this.ready = new Promise((resolve, reject) => {
      this.resolve = resolve;
      this.reject = reject;
    });
    this.ready.catch(() => undefined); // a message says it
    this.stage = new Stage(byId("stage"), backend, {
      drawn: () => this.drawn(),
      awaiting: () => this.live.awaiting(),
      settled: () => this.settled(),
      lost: (reason) => this.lost(reason),
      failed: (error) => this.messages.error(errorText(error)),
    });
    this.look = new Look(this.stage);
    this.video = new Video(this.stage);
    this.panel = new Panel(byId("sections"), byId("search"), byId("found"), () => this.written());
    this.live = new Live(byId("live-state"), {
      changed: (id) => this.changed(id),
      message: (text) => this.messages.status(text),
      arrived: () => this.arrived(),
      posed: () => {
        this.stage.watched = true;
      },
    });
    this.stage.movers.push(this.clips.move, this.live.move);
    this.connect();
  }

  /** Loads and shows an avatar. Errors become messages, and what was shown before stays. */
  async open(source: Source, name: string, { preview, again, called }: Opening): Promise<void> {
    byId("empty").hidden = true;
    if (!again) this.loading.setPoster(preview);
    try {
      const avatar = await this.loading.load(source, name);
      if (avatar === null) {
        this.loading.hidePoster();
        if (this.stage.avatar === null) this.showEmpty();
        return;
      }
      if (!again && preview === null) this.loading.setPoster(avatar.preview);
      this.messages.clear();
      this.called = called ?? avatar.name;
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

  /** Stops clips, while something else than the avatar is shown. */
  pause(): void {
    this.clips.pause();
  }

  /** Listens to the server; `live`: motion may arrive. */
  listen(live: boolean): void {
    byId("live-button").hidden = !live;
    byId("live-state").hidden = !live;
    this.setFollow(live);
    this.live.connect();
  }

  /** Puts an avatar on the stage and fills the controls. With `again`, pose, view and clip go on. */
  private show(avatar: Avatar, again: boolean, old: Instance | null = this.stage.instance): void {
    const { pose } = this.stage.show(avatar);
    if (again && old !== null) carryPose(old.avatar, old.pose, avatar, pose);
    this.awaited = true;
    this.inputs = this.inputsOf(avatar, pose);
    this.live.setAvatar(this.inputs);
    this.stage.orbit.setFraming(avatar.framing, again);
    this.clips.setAvatar(this.motions(avatar), pose, again);
    if (this.play && !again && !this.live.follow && !this.clips.playing) this.clips.toggle();
    this.fillPanel(avatar, pose);
    byId("frame-button").hidden = !this.stage.orbit.hasHead;
    setText(byId("name"), this.called);
    document.title = printable(`${this.called} · Avatar viewer`);
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
    byId("sections").prepend(this.look.element);
    byId("sections").append(aboutSection(avatar, this.stage.player?.backend ?? ""));
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
    const recording = parseLiveLinkCsv(text, name);
    this.recordings = [...this.recordings.filter((old) => old.name !== name), { name, recording }];
    this.clips.add(recordingMotion(name, recording, this.inputs));
    this.messages.note(`${name} plays`);
  }

  private drawn(): void {
    const now = performance.now();
    if (now - this.shownAt < PANEL_EVERY_MS) return;
    this.showValues(now);
  }

  private settled(): void {
    this.live.shown();
    if (this.awaited && this.stage.instance !== null) {
      this.awaited = false;
      this.loading.hidePoster();
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
    this.video.stop();
    this.clips.pause();
    this.messages.error(`The graphics device was lost (${reason}). The last picture stays.`, {
      label: "Restart",
      run: () => void this.restart(this.stage.instance),
    });
  }

  private async restart(instance: Instance | null): Promise<void> {
    try {
      await this.stage.restart();
      if (instance !== null) this.show(instance.avatar, true, instance);
    } catch (error) {
      this.messages.error(errorText(error), { label: "Restart", run: () => void this.restart(instance) });
    }
  }

  /** Buttons, files and keys. */
  private connect(): void {
    this.clips.changed = () => this.stage.ask();
    this.clips.started = () => this.setFollow(false);
    this.live.ask = () => this.stage.ask();
    const press = (id: string, run: () => void): void => byId(id).addEventListener("click", run);
    press("frame-button", () => this.stage.orbit.toggle());
    press("live-button", () => this.setFollow(!this.live.follow));
    press("reset-button", () => this.resetPose());
    press("photo-button", () => void this.takePicture());
    press("video-button", () => this.toggleVideo());
    press("full-button", () => void this.toggleFullScreen());
    press("panel-button", () => this.showPanel(byId("panel-button").getAttribute("aria-expanded") === "false"));
    press("help-button", () => byId<HTMLDialogElement>("help").showModal());
    press("help-close", () => byId<HTMLDialogElement>("help").close());
    listenForFiles({
      avatar: (file) => this.open(file, file.name, { preview: null, again: false, called: null }),
      recording: (name, text) => this.record(name, text),
      failed: (error) => this.messages.error(errorText(error)),
    });
    const keys = keysOf({ orbit: this.stage.orbit, clips: this.clips, look: this.look });
    listenForKeys(keys);
    showKeys(byId("keys"), keys);
    this.showPanel(!matchMedia(NARROW).matches);
  }

  private resetPose(): void {
    this.inputs?.clear();
    this.stage.instance?.pose.reset();
    this.written();
    this.panel.show();
  }

  private showPanel(shown: boolean): void {
    byId("viewer").classList.toggle("no-panel", !shown);
    byId("panel-button").setAttribute("aria-expanded", String(shown));
    if (shown) this.panel.show();
  }

  private async takePicture(): Promise<void> {
    if (this.stage.instance === null) return;
    try {
      this.messages.note(`Saved ${await takePicture(this.stage)}`);
    } catch (error) {
      this.messages.error(errorText(error));
    }
  }

  private toggleVideo(): void {
    const button = byId("video-button");
    const stopped = (): void => button.setAttribute("aria-pressed", "false");
    if (this.video.recording) {
      this.video.stop();
      return;
    }
    if (this.stage.instance === null) return;
    const failed = (error: unknown): void => {
      stopped();
      this.messages.error(errorText(error));
    };
    try {
      this.video.start((name) => {
        stopped();
        this.messages.note(`Saved ${name}`);
      }, failed);
      button.setAttribute("aria-pressed", "true");
    } catch (error) {
      failed(error);
    }
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
