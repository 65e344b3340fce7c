import { AvatarError } from "../errors.js";

export const U32_MAX = 0xffffffff;
const SHOWN = 40; // letters of a wrong value in a message

/** A JSON value and where it stands. Every reader checks the value and throws AvatarError that names the place. */
export class Json {
  constructor(
    readonly value: unknown,
    readonly path: string,
  ) {}

  /** Member `name` of an object; its value is undefined if it is missing. */
  at(name: string): Json {
    const members = this.object();
    return new Json(Object.hasOwn(members, name) ? members[name] : undefined, `${this.path}.${name}`);
  }

  /** Member `name`, or `read` of it: null if it is missing or null. */
  optional<T>(name: string, read: (member: Json) => T): T | null {
    const member = this.at(name);
    return member.value === undefined || member.value === null ? null : read(member);
  }

  /** The members of an object by name. */
  entries(): [string, Json][] {
    const members = this.object();
    return Object.keys(members).map((name) => [name, new Json(members[name], `${this.path}.${name}`)]);
  }

  /** A list of at least `least` and at most `most` values. */
  list(least = 0, most = Infinity): Json[] {
    if (!Array.isArray(this.value)) throw this.error("a list is needed");
    const values: readonly unknown[] = this.value;
    if (values.length < least || values.length > most) {
      throw new AvatarError(`has ${values.length} items; ${least} to ${most} are taken`, { field: this.path });
    }
    return values.map((value, index) => new Json(value, `${this.path}[${index}]`));
  }

  /** Text of at most `most` letters. */
  text(most = Infinity, least = 0): string {
    if (typeof this.value !== "string" || this.value.length < least || this.value.length > most) {
      throw this.error(least > 0 ? "a name is needed" : "text is needed");
    }
    return this.value;
  }

  /** A name: text that is not empty. */
  name(most = Infinity): string {
    return this.text(most, 1);
  }

  /** Names without duplicates. */
  names(): string[] {
    const found = this.list().map((one) => one.name());
    if (new Set(found).size !== found.length) throw new AvatarError("has a name twice", { field: this.path });
    return found;
  }

  /** One of `known`. */
  one<T extends string>(known: readonly T[]): T {
    if (!known.includes(this.value as T)) {
      throw new AvatarError(`${shown(this.value)} is unknown to this reader (it knows ${known.join(", ")})`, {
        field: this.path,
      });
    }
    return this.value as T;
  }

  /** A whole number. */
  whole(least = 0, most = U32_MAX): number {
    if (typeof this.value !== "number" || !Number.isInteger(this.value) || this.value < least || this.value > most) {
      throw this.error(`a whole number of ${least} to ${most} is needed`);
    }
    return this.value;
  }

  /** A finite number. */
  number(): number {
    if (typeof this.value !== "number" || !Number.isFinite(this.value)) throw this.error("a finite number is needed");
    return this.value;
  }

  /** true or false. */
  flag(): boolean {
    if (typeof this.value !== "boolean") throw this.error("true or false is needed");
    return this.value;
  }

  /** Three numbers. */
  vector(): [number, number, number] {
    const [x, y, z] = this.list(3, 3).map((one) => one.number());
    return [x as number, y as number, z as number];
  }

  /** The error for a value of another kind. */
  error(needed: string): AvatarError {
    const found = this.value === undefined ? "is missing" : `is ${shown(this.value)}`;
    return new AvatarError(`${found}; ${needed}`, { field: this.path });
  }

  private object(): Record<string, unknown> {
    if (typeof this.value !== "object" || this.value === null || Array.isArray(this.value)) {
      throw this.error("a JSON object is needed");
    }
    return this.value as Record<string, unknown>;
  }
}

/** A wrong value as a person may read it: short, on one line. */
export function shown(value: unknown): string {
  if (typeof value === "string") return `'${value.slice(0, SHOWN)}'`;
  if (typeof value === "object" && value !== null) return Array.isArray(value) ? "a list" : "an object";
  return String(value).slice(0, SHOWN);
}
