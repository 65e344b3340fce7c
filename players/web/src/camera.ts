import { AvatarError } from "./errors.js";
import { invertLinear } from "./pose/affine.js";

const NEAR = 0.01; // of the projection matrix only; each avatar decides from which depth on it is drawn
const FAR = 100;
const DEPTH = FAR / (FAR - NEAR);

/** Any array of numbers. */
export type Numbers = ArrayLike<number>;

const CAMERA = { owner: "the camera" };
const VIEW = new Float64Array(16);
const PROJECTION = new Float64Array(12); // rows 0, 1 and 2; row 3 is 0 0 1 0
const INVERSE = new Float64Array(12);
const ROTATION = new Float64Array(9);
const TRANSLATION = new Float64Array(3);
const INTRINSICS = new Float64Array(9);

/**
 * A pinhole camera: +x right, +y down, +z forward, pixel centres at integers. Matrices are row-major for column
 * vectors, float32. No method allocates.
 */
export class Camera {
  /** camera from world, [4, 4]. */
  readonly cameraFromWorld = new Float32Array(16);
  /** clip from world, [4, 4]: y of clip space points down the image. */
  readonly clipFromWorld = new Float32Array(16);
  /** Where the camera is, world, [3]. */
  readonly centre = new Float32Array(3);
  /** width / (2 fx) and height / (2 fy). */
  readonly tanHalfFov = new Float32Array(2);
  /** Pixels. */
  width = 1;
  /** Pixels. */
  height = 1;

  constructor() {
    this.orbit([0, 0, 0], 1, 0, 0, Math.PI / 4, 1, 1);
  }

  /**
   * Looks at `target` [3] (world) from `distance`. `yaw` about +Y, positive towards +X, and `pitch`, positive upwards,
   * are in radians, and so is the vertical field of view. At yaw 0 the camera is before a face that looks along +Z.
   */
  orbit(
    target: Numbers,
    distance: number,
    yaw: number,
    pitch: number,
    fovY: number,
    width: number,
    height: number,
  ): void {
    const sy = Math.sin(yaw), cy = Math.cos(yaw), sp = Math.sin(pitch), cp = Math.cos(pitch);
    const r = ROTATION;
    r[0] = cy, r[1] = 0, r[2] = -sy; // right
    r[3] = sp * sy, r[4] = -cp, r[5] = sp * cy; // down = forward x right
    r[6] = -sy * cp, r[7] = -sp, r[8] = -cy * cp; // forward
    const ex = (target[0] as number) + distance * sy * cp;
    const ey = (target[1] as number) + distance * sp;
    const ez = (target[2] as number) + distance * cy * cp;
    for (let i = 0; i < 3; i++) {
      TRANSLATION[i] = -((r[3 * i] as number) * ex + (r[3 * i + 1] as number) * ey + (r[3 * i + 2] as number) * ez);
    }
    const focal = height / (2 * Math.tan(fovY / 2));
    INTRINSICS.fill(0);
    INTRINSICS[0] = INTRINSICS[4] = focal;
    INTRINSICS[2] = width / 2;
    INTRINSICS[5] = height / 2;
    INTRINSICS[8] = 1;
    this.fromOpencv(r, TRANSLATION, INTRINSICS, width, height);
  }

  /**
   * x_camera = rotation x_world + translation, x_pixel = K x_camera / z - 0.5. `rotation` [3, 3] and `intrinsics` K
   * [3, 3] are row-major, K in pixels with pixel centres at half integers. Throws AvatarError for an empty image.
   */
  fromOpencv(rotation: Numbers, translation: Numbers, intrinsics: Numbers, width: number, height: number): void {
    checkSize(width, height);
    for (let i = 0; i < 3; i++) {
      for (let j = 0; j < 3; j++) VIEW[4 * i + j] = rotation[3 * i + j] as number;
      VIEW[4 * i + 3] = translation[i] as number;
    }
    const k = intrinsics as ArrayLike<number>;
    PROJECTION.fill(0);
    PROJECTION[0] = (2 * (k[0] as number)) / width;
    PROJECTION[1] = (2 * (k[1] as number)) / width;
    PROJECTION[2] = (2 * (k[2] as number)) / width - 1;
    PROJECTION[5] = (2 * (k[4] as number)) / height;
    PROJECTION[6] = (2 * (k[5] as number)) / height - 1;
    this.tanHalfFov[0] = width / (2 * (k[0] as number));
    this.tanHalfFov[1] = height / (2 * (k[4] as number));
    this.write(width, height);
  }

  /**
   * The camera of an engine: `view` (camera from world) and `projection` [4, 4], both column-major, as OpenGL and
   * three.js have them: y up, looking along -z. A projection for cameras that look along +z (Babylon.js) is
   * recognised by its last row. Its depth range does not matter. Throws AvatarError for one without perspective.
   */
  fromOpengl(view: Numbers, projection: Numbers, width: number, height: number): void {
    checkSize(width, height);
    const along = projection[11] as number; // clip w = along * z of the engine's camera
    if (!(Math.abs(along) > 1e-6) || Math.abs(projection[15] as number) > 1e-6) {
      throw new AvatarError("has no perspective; an orthographic camera cannot show an avatar", CAMERA);
    }
    const size = Math.abs(along), ahead = Math.sign(along);
    for (let column = 0; column < 4; column++) {
      VIEW[column] = view[4 * column] as number;
      VIEW[4 + column] = -(view[4 * column + 1] as number);
      VIEW[8 + column] = ahead * (view[4 * column + 2] as number);
    }
    PROJECTION.fill(0);
    PROJECTION[0] = (projection[0] as number) / size;
    PROJECTION[1] = -(projection[4] as number) / size;
    PROJECTION[2] = (ahead * (projection[8] as number)) / size;
    PROJECTION[4] = -(projection[1] as number) / size;
    PROJECTION[5] = (projection[5] as number) / size;
    PROJECTION[6] = (-ahead * (projection[9] as number)) / size;
    this.tanHalfFov[0] = 1 / (PROJECTION[0] as number);
    this.tanHalfFov[1] = 1 / (PROJECTION[5] as number);
    this.write(width, height);
  }

  /** Takes matrices as they are: [4, 4] row-major each, the centre [3] and the tangents [2]. */
  setMatrices(cameraFromWorld: Numbers, clipFromWorld: Numbers, centre: Numbers, tanHalfFov: Numbers, width: number, height: number): void {
    checkSize(width, height);
    this.cameraFromWorld.set(cameraFromWorld);
    this.clipFromWorld.set(clipFromWorld);
    this.centre.set(centre);
    this.tanHalfFov.set(tanHalfFov);
    this.width = width;
    this.height = height;
  }

  /** Takes over all of `other`. */
  copy(other: Camera): void {
    this.cameraFromWorld.set(other.cameraFromWorld);
    this.clipFromWorld.set(other.clipFromWorld);
    this.centre.set(other.centre);
    this.tanHalfFov.set(other.tanHalfFov);
    this.width = other.width;
    this.height = other.height;
  }

  /** Writes everything that follows from VIEW and PROJECTION. */
  private write(width: number, height: number): void {
    this.width = width;
    this.height = height;
    VIEW[12] = VIEW[13] = VIEW[14] = 0;
    VIEW[15] = 1;
    PROJECTION[10] = DEPTH;
    PROJECTION[11] = -DEPTH * NEAR;
    for (let i = 0; i < 16; i++) this.cameraFromWorld[i] = VIEW[i] as number;
    for (let row = 0; row < 3; row++) {
      for (let column = 0; column < 4; column++) {
        let sum = 0;
        for (let k = 0; k < 4; k++) sum += (PROJECTION[4 * row + k] as number) * (VIEW[4 * k + column] as number);
        this.clipFromWorld[4 * row + column] = sum;
      }
    }
    for (let column = 0; column < 4; column++) this.clipFromWorld[12 + column] = VIEW[8 + column] as number;
    invertLinear(INVERSE, 0, VIEW, 0);
    for (let i = 0; i < 3; i++) {
      const r = 4 * i;
      this.centre[i] = -(
        (INVERSE[r] as number) * (VIEW[3] as number) +
        (INVERSE[r + 1] as number) * (VIEW[7] as number) +
        (INVERSE[r + 2] as number) * (VIEW[11] as number)
      );
    }
  }
}

function checkSize(width: number, height: number): void {
  if (!(width >= 1 && height >= 1)) {
    throw new AvatarError(`an image of ${width}x${height} pixels is empty; both sizes must be at least 1`, CAMERA);
  }
}
