// Holds the document of a pack against its form, which is made from the JSON Schemas and the same for all players.

import { AvatarError } from "../errors.js";
import { PACK_FORM } from "../made/pack_form.js";
import { parseJson, shown, type Value } from "./json.js";

/** What a value must be. Keywords are those of JSON Schema, and concern only values of their kind. */
interface Form {
  readonly $ref?: string; // #/$defs/NAME
  readonly $defs?: Readonly<Record<string, Form>>;
  readonly anyOf?: readonly Form[]; // asked last
  readonly description?: string; // what is wrong where none of `anyOf` fits
  readonly type?: string | readonly string[];
  readonly enum?: readonly Value[];
  readonly const?: Value;
  readonly required?: readonly string[];
  readonly properties?: Readonly<Record<string, Form>>;
  readonly additionalProperties?: Form;
  readonly items?: Form;
  readonly minItems?: number;
  readonly maxItems?: number;
  readonly uniqueItems?: boolean; // of texts
  readonly minLength?: number;
  readonly maxLength?: number;
  readonly format?: string;
  readonly minimum?: number;
  readonly maximum?: number;
  readonly exclusiveMinimum?: number;
}

/** What is wrong, and where in the value. */
interface Fault {
  readonly at: string;
  readonly says: string;
}

const DEFINITION = "#/$defs/";
const MOST_NAME = 80; // letters in a path
const NEEDED: Readonly<Record<string, string>> = {
  object: "a JSON object",
  array: "a list",
  string: "text",
  number: "a finite number",
  integer: "a whole number",
  boolean: "true or false",
};
const FORMATS: Readonly<Record<string, readonly [RegExp, string]>> = {
  version: [/^(0|[1-9][0-9]{0,8})\.(0|[1-9][0-9]{0,8})$/, '"MAJOR.MINOR" is needed'],
  sha256: [/^[0-9a-f]{64}$/, "64 digits 0 to f are needed"],
};
let whole: Form | undefined;

/** Throws AvatarError, which names the place, unless a document has the form of a pack's. */
export function checkForm(document: Value): void {
  whole ??= parseJson(PACK_FORM, "form") as Form;
  const found = fault(document, whole);
  if (found !== null) throw new AvatarError(found.says, { field: `$${found.at}` });
}

/** The numbers of "MAJOR.MINOR"; null for anything else. */
export function versionOf(value: Value | undefined): [major: number, minor: number] | null {
  const found = typeof value === "string" ? FORMATS["version"]?.[0].exec(value) : null;
  return found ? [Number(found[1]), Number(found[2])] : null;
}

/** The members of an object; none of another value. */
export function membersOf(value: Value | undefined): { readonly [name: string]: Value } {
  return typeof value === "object" && value !== null && !Array.isArray(value) ? value : {};
}

function fault(value: Value, form: Form): Fault | null {
  if (form.$ref !== undefined) return fault(value, defined(form));
  const says = misfit(value, form);
  if (says !== null) return { at: "", says };
  return inside(value, form) ?? (form.anyOf === undefined ? null : inAll(value, form.anyOf, form.description));
}

function inside(value: Value, form: Form): Fault | null {
  if (Array.isArray(value)) return inItems(value, form);
  return typeof value === "object" && value !== null ? inMembers(value, form) : null;
}

/** What is wrong if no form fits: what is said of all of them, else what is wrong for one. */
function inAll(value: Value, forms: readonly Form[], says: string | undefined): Fault | null {
  let last: Fault | null = null;
  for (const form of forms) {
    const found = fault(value, form);
    if (found === null) return null;
    if (last === null || last.at === "") last = found;
  }
  return says === undefined ? last : { at: "", says };
}

function defined(form: Form): Form {
  return form.$ref === undefined ? form : (whole?.$defs?.[form.$ref.slice(DEFINITION.length)] as Form);
}

function inItems(items: readonly Value[], { items: form }: Form): Fault | null {
  if (form === undefined) return null;
  for (let i = 0; i < items.length; i++) {
    const found = fault(items[i] as Value, form);
    if (found !== null) return { ...found, at: `[${i}]${found.at}` };
  }
  return null;
}

function inMembers(members: { readonly [name: string]: Value }, form: Form): Fault | null {
  const { properties = {}, additionalProperties: others } = form;
  for (const name of form.required ?? []) {
    if (Object.hasOwn(members, name)) continue;
    const { type } = defined(properties[name] ?? {});
    return { at: `.${name}`, says: type === undefined ? "is missing" : `is missing; ${needed(type)}` };
  }
  for (const name in others === undefined ? properties : members) {
    const one = Object.hasOwn(properties, name) ? properties[name] : others;
    if (one === undefined || !Object.hasOwn(members, name)) continue;
    const found = fault(members[name] as Value, one);
    if (found !== null) return { ...found, at: `.${name.slice(0, MOST_NAME)}${found.at}` };
  }
  return null;
}

/** What is wrong with a value itself, whatever is inside of it. */
function misfit(value: Value, form: Form): string | null {
  if (form.type !== undefined && !isOf(value, form.type)) return `is ${shown(value)}; ${needed(form.type, form.minLength)}`;
  const known = form.enum ?? (form.const === undefined ? [value] : [form.const]);
  if (!known.includes(value)) return `${shown(value)} is unknown to this reader (it knows ${known.join(", ")})`;
  if (typeof value === "number") return beyond(value, form);
  if (typeof value === "string") return misspelt(value, form);
  return Array.isArray(value) ? miscounted(value, form) : null;
}

function beyond(value: number, { minimum = -Infinity, maximum = Infinity, exclusiveMinimum = -Infinity }: Form): string | null {
  if (value >= minimum && value <= maximum && value > exclusiveMinimum) return null;
  const low = exclusiveMinimum > minimum ? `more than ${exclusiveMinimum}` : `at least ${minimum}`;
  return `is ${value}; ${maximum === Infinity ? low : `${minimum} to ${maximum}`} is needed`;
}

function misspelt(value: string, { minLength, maxLength, format }: Form): string | null {
  let letters = value.length; // an empty text has none, and any other one or more
  if (letters > (maxLength ?? Infinity)) letters = value.replace(/[\ud800-\udbff]/g, "").length;
  if (letters < (minLength ?? 0)) return `is ${shown(value)}; a name is needed`;
  if (letters > (maxLength ?? Infinity)) return `has ${letters} letters; at most ${maxLength} are taken`;
  const found = format === undefined ? undefined : FORMATS[format];
  return found === undefined || found[0].test(value) ? null : `is ${shown(value)}; ${found[1]}`;
}

function miscounted(items: readonly Value[], { minItems = 0, maxItems = Infinity, uniqueItems }: Form): string | null {
  const { length } = items;
  if (length < minItems || length > maxItems) {
    const taken = maxItems === Infinity ? `at least ${minItems}` : `${minItems} to ${maxItems}`;
    return `has ${length} items; ${taken} are taken`;
  }
  return uniqueItems === true && new Set(items).size < length ? "has a name twice" : null;
}

function isOf(value: Value, type: string | readonly string[]): boolean {
  const kind = value === null ? "null" : Array.isArray(value) ? "array" : typeof value;
  if (typeof type !== "string") return type.some((one) => isOf(value, one));
  return kind === type || (type === "integer" && Number.isInteger(value));
}

function needed(type: string | readonly string[], minLength = 0): string {
  const kinds = [type].flat().map((kind) => (kind === "string" && minLength > 0 ? "a name" : (NEEDED[kind] ?? kind)));
  return `${kinds.join(" or ")} is needed`;
}
