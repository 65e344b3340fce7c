// What stages share. A stage is the scene of an engine, 128 x 128 pixels, whose camera looks along -z at the origin:
//
// makeStage({api, distance, synchronous, antialias, target, ...}) makes it; target: it draws into one of the engine.
// newer          set when there is a newer picture than the one shown
// add(avatar, level)   puts an avatar into it; an actor: place(x, y, z, yaw, scale), show(visible), attach(attached) below
//                another node, as the engine's users do, seen() -> [heightPx, level that serves], dispose(), in
//                three.js clone()
// dense(z)       of the player: the most alpha that a splat nearer than a plane at z has at each pixel
// wall(z)        an opaque plane that faces the camera, where x < 0; null: none
// pane(z)        a plane over the whole view that is drawn after the avatars, as transparent things are; null: none
// lamps(list)    lights of the engine in place of those before: {kind: "ambient", "sky", "sun", "bulb" or "spot", colour
//                (linear), intensity, casts, and where}; ball(on): a white matt ball of RADIUS about the origin
//                an actor: lit() -> the numbers of its light
// floor(z)       a white matt plane that faces the camera, and on which shadows fall that avatars cast if the option shadows
//                is set; MAP: what the map of a lamp that casts holds, metres about the origin
// part(x, y, size)   the camera draws its middle into a square of the target, y from below; fovOf(size) sees it
// draw(), finished(), read()   RGBA bytes as displayed, first row on top
// lose()         the WebGL context is lost and comes back; orthographic(on); disposeAvatars(); errors() of the graphics

export const SIZE = 128;
export const FOV_Y = 0.6; // radians
/** Colours as displayed, 0..255. */
export const BACKGROUND = [40, 60, 120];
export const WALL = [200, 90, 30];

/** The angle, radians, of a camera that sees the middle `size` pixels. */
export const fovOf = (size) => 2 * Math.atan((Math.tan(FOV_Y / 2) * size) / SIZE);

export const RADIUS = 0.08; // of the ball, metres

export const MAP = { texels: 1024, radius: 1.6, far: 6 };

/** Poses an avatar: turns joints by vectors, sets weights, moves it by a right-handed [4, 4]. */
export function setPose({ avatar, pose }, { joints = {}, expressions = {}, world = null }) {
  pose.reset();
  for (const [name, vector] of Object.entries(joints)) pose.setJoint(name, ...vector);
  for (const [name, weight] of Object.entries(expressions)) pose.setExpression(name, weight);
  const side = avatar.handedness === "left" ? -1 : 1; // arrays of a pose are in the frame of the pack
  if (world !== null) pose.worldFromAvatar.set(world.map((value, i) => (i < 4 !== (i % 4 === 0) ? side * value : value)));
}

/** The numbers of the light of an instance. */
export const numbersOf = ({ lighting }) =>
  lighting && { ambient: [...lighting.ambient], places: [...lighting.places], colours: [...lighting.colours], count: lighting.count, shadow: lighting.shadow };

export const nothing = () => undefined;

/** Those of AvatarScene. */
export const optionsOf = ({ synchronous, depthAlpha, shadows }) => ({ synchronous, depthAlpha, shadows });

/** Bytes of 0..255, rounded outside. */
export function clamped(values) {
  return new Uint8Array(Uint8ClampedArray.from(values).buffer);
}

/** Rows of what WebGL read, first row on top. */
export function flipped(pixels) {
  const row = 4 * SIZE;
  return clamped(Array.from(pixels, (_, i) => pixels[row * (SIZE - 1 - Math.floor(i / row)) + (i % row)]));
}

export function makeCanvas() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE;
  return canvas;
}

/** What stages with WebGL have in common; `read` gives what was drawn onto the canvas. */
export function webGl(gl) {
  return {
    drawn: () => gl.finish(), // WebKitGTK reads what is not drawn yet
    read() {
      const pixels = new Uint8Array(4 * SIZE * SIZE);
      const bound = gl.getParameter(gl.READ_FRAMEBUFFER_BINDING);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
      gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, bound);
      return flipped(pixels);
    },
    /** Resolves when the engine has heard both. */
    async lose() {
      const extension = gl.getExtension("WEBGL_lose_context");
      for (const [event, run] of [["webglcontextlost", () => extension.loseContext()], ["webglcontextrestored", () => extension.restoreContext()]]) {
        const heard = new Promise((resolve) => gl.canvas.addEventListener(event, resolve, { once: true }));
        run();
        await heard;
        await new Promise((resolve) => setTimeout(resolve)); // a context may be restored in a later task alone
      }
    },
    async errors() {
      const found = [];
      for (let code = gl.getError(); code !== gl.NO_ERROR; code = gl.getError()) found.push(`WebGL error ${code}`);
      return found;
    },
  };
}
