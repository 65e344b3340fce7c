// Parses JSON as every player does, by the letter of RFC 8259. JSON.parse takes more: names that stand twice, any depth,
// numbers that no float64 holds, half surrogates.

import { AvatarError } from "../errors.js";

/** A parsed value. */
export type Value = null | boolean | number | string | Value[] | { [name: string]: Value };

export const U32_MAX = 0xffffffff;
const MOST_DEPTH = 64; // lists and objects inside each other
const MOST_VALUES = 2 ** 21;
const MOST_WHOLE = "9007199254740992"; // 2^53
const NUMBER = /-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?/y;
const WORDS = new Map<string, Value>([["true", true], ["false", false], ["null", null]]);
const SPACE = 32, QUOTE = 34, BACKSLASH = 92; // codes
const SHOWN = 40; // letters of a wrong value in a message

/** The value that UTF-8 or text says. Throws AvatarError, which calls it `what`. */
export function parseJson(source: Uint8Array | string, what: string): Value {
  try {
    return new Parser(typeof source === "string" ? source : textOf(source)).all();
  } catch (error) {
    throw error instanceof AvatarError ? new AvatarError(`its ${what} is not JSON (${error.reason})`) : error;
  }
}

function textOf(bytes: Uint8Array): string {
  try {
    return new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes);
  } catch {
    throw new AvatarError("it is not UTF-8");
  }
}

class Parser {
  private at = 0;
  private depth = 0;
  private values = 0;

  constructor(private readonly source: string) {}

  all(): Value {
    const value = this.value();
    if (this.next() !== "") throw this.error("more text follows the value");
    return value;
  }

  private error(what: string): AvatarError {
    return new AvatarError(`${what} at letter ${this.at}`);
  }

  /** The next letter behind spaces, "" at the end. */
  private next(): string {
    for (;;) {
      const code = this.source.charCodeAt(this.at);
      if (code !== SPACE && code !== 10 && code !== 13 && code !== 9) return this.source.charAt(this.at);
      this.at++;
    }
  }

  private value(): Value {
    if (++this.values > MOST_VALUES) throw this.error(`more than ${MOST_VALUES} values`);
    const first = this.next();
    if (first === '"') return this.text();
    if (first !== "{" && first !== "[") return this.number() ?? this.word();
    if (++this.depth > MOST_DEPTH) throw this.error(`more than ${MOST_DEPTH} values inside each other`);
    const found = first === "{" ? this.object() : this.list();
    this.depth--;
    return found;
  }

  private object(): Value {
    const members: { [name: string]: Value } = {};
    if (this.isEmpty("}")) return members;
    let count = 0;
    do {
      if (this.next() !== '"') throw this.error("a name is needed");
      const name = this.text();
      if (this.next() !== ":") throw this.error("a colon is needed");
      this.at++;
      const value = this.value();
      if (name !== "__proto__") members[name] = value;
      else Object.defineProperty(members, name, { value, enumerable: true, configurable: true });
      count++;
    } while (this.goesOn("}"));
    if (Object.keys(members).length < count) throw this.error("a name stands twice");
    return members;
  }

  private list(): Value {
    const items: Value[] = [];
    if (this.isEmpty("]")) return items;
    do items.push(this.value());
    while (this.goesOn("]"));
    return items;
  }

  /** Goes over the bracket; whether the other one follows, and over that. */
  private isEmpty(end: string): boolean {
    this.at++;
    if (this.next() !== end) return false;
    this.at++;
    return true;
  }

  /** Goes over a comma, or the bracket at the end. */
  private goesOn(end: string): boolean {
    const letter = this.next();
    if (letter !== "," && letter !== end) throw this.error(`a comma or ${end} is needed`);
    this.at++;
    return letter === ",";
  }

  private text(): string {
    const begin = this.at;
    let code = 0, escapes = false;
    while ((code = this.source.charCodeAt(++this.at)) !== QUOTE) {
      if (code === BACKSLASH) {
        escapes = true;
        this.at++;
      } else if (!(code >= SPACE)) {
        throw this.error(this.at < this.source.length ? "a control letter" : "a text without end");
      }
    }
    this.at++;
    return escapes ? this.unescaped(begin) : this.source.slice(begin + 1, this.at - 1);
  }

  private unescaped(begin: number): string {
    try {
      const text = JSON.parse(this.source.slice(begin, this.at)) as string; // alone, it is as strict as RFC 8259
      if (!/[\0\ud800-\udfff]/u.test(text)) return text;
    } catch {
      // Said below, too.
    }
    throw this.error("an unknown escape, U+0000, or half of a pair");
  }

  private number(): number | undefined {
    NUMBER.lastIndex = this.at;
    if (!NUMBER.test(this.source)) return undefined;
    const said = this.source.slice(this.at, NUMBER.lastIndex);
    const number = Number(said);
    const digits = said.replace("-", "");
    const { length } = MOST_WHOLE;
    const long = digits.length > length || (digits.length === length && digits > MOST_WHOLE);
    if (!Number.isFinite(number) || (long && !/[.eE]/.test(said))) throw this.error("a number that float64 does not hold");
    this.at = NUMBER.lastIndex;
    return number + 0; // -0 is 0
  }

  private word(): Value {
    for (const [word, value] of WORDS) {
      if (this.source.startsWith(word, this.at)) {
        this.at += word.length;
        return value;
      }
    }
    throw this.error(this.next() === "" ? "the text ends too early" : "an unknown word");
  }
}

/** A wrong value as a person may read it: short. */
export function shown(value: unknown): string {
  if (typeof value === "string") return `'${value.slice(0, SHOWN)}'`;
  if (typeof value === "object" && value !== null) return Array.isArray(value) ? "a list" : "an object";
  return String(value);
}
