/** Where an error is: whose avatar or file it is, and which field of it. */
export interface Where {
  readonly owner?: string | undefined;
  readonly field?: string | undefined;
}

// Letters that control a terminal, the direction of text or nothing that is seen, and halves of pairs.
const CONTROL = /[\0-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]/gu;
const LONGEST_REASON = 320;
const LONGEST_PLACE = 160;

/** Text of a pack as a person may see it: letters that control something as \u202e. */
export function printable(text: string): string {
  return text.replace(CONTROL, (letter) => `\\u${letter.charCodeAt(0).toString(16).padStart(4, "0")}`);
}

/** An avatar, a pack or a browser that cannot be used. One line: whose file, which field, what, what to do. */
export class AvatarError extends Error {
  readonly owner: string | undefined;
  readonly field: string | undefined;
  readonly reason: string; // the message without owner and field

  constructor(reason: string, where: Where = {}) {
    const owner = cut(where.owner, LONGEST_PLACE);
    const field = cut(where.field, LONGEST_PLACE);
    const told = cut(reason, LONGEST_REASON) as string;
    super([owner, field, told].filter((part) => part !== undefined && part !== "").join(": "));
    this.name = "AvatarError";
    this.owner = owner;
    this.field = field;
    this.reason = told;
  }

  /** The same error of `owner`, for what was thrown where the owner is not known. */
  of(owner: string): AvatarError {
    return new AvatarError(this.reason, { owner, field: this.field });
  }
}

function cut(text: string | undefined, most: number): string | undefined {
  if (text === undefined) return undefined;
  return printable(text.length > most ? `${text.slice(0, most)}...` : text);
}

const LISTED = 8;
const COMPARED = 1000; // names that a wrong one is compared with
const NEAR = 0.5; // least likeness of a near match
const LONGEST = 80; // letters of a name that are compared and shown

/** The error for a `name` that is not among the `known` names of a `what`. It lists near matches. */
export function noSuch(what: string, name: string, known: readonly string[], where: Where = {}): AvatarError {
  const wanted = name.slice(0, LONGEST).toLowerCase();
  const ranked = known
    .slice(0, COMPARED)
    .map((one) => ({ one, score: likeness(wanted, one.slice(0, LONGEST).toLowerCase()) }))
    .filter((row) => row.score >= NEAR)
    .sort((a, b) => b.score - a.score)
    .slice(0, 3)
    .map((row) => row.one);
  const listed = known.slice(0, LISTED).join(", ") + (known.length > LISTED ? ", ..." : "");
  const all = `there are ${known.length}: ${listed || "none"}`;
  const hint = ranked.length > 0 ? `did you mean ${ranked.join(" or ")}?` : all;
  const article = /^[aeiou]/i.test(what) ? "an" : "a";
  return new AvatarError(`'${name.slice(0, LONGEST)}' is not ${article} ${what}; ${hint}`, where);
}

/** How alike two texts are, 0 to 1: the share of pairs of neighbouring letters that both have. */
function likeness(a: string, b: string): number {
  if (a === b) return 1;
  const left = pairs(a);
  const right = pairs(b);
  let shared = 0;
  for (const [pair, count] of left) shared += Math.min(count, right.get(pair) ?? 0);
  return (2 * shared) / Math.max(a.length + b.length + 2, 1);
}

/** The pairs of neighbouring letters of a text, its two ends included, with how often each occurs. */
function pairs(text: string): Map<string, number> {
  const found = new Map<string, number>();
  const padded = ` ${text} `;
  for (let i = 0; i + 1 < padded.length; i++) {
    const pair = padded.slice(i, i + 2);
    found.set(pair, (found.get(pair) ?? 0) + 1);
  }
  return found;
}
