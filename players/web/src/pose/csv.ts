import { AvatarError } from "../errors.js";

/** A record of a CSV file: the line on which it begins (from 1), and its fields. */
export interface Row {
  readonly line: number;
  readonly fields: string[];
}

/** The records of a CSV text, with quotes as RFC 4180 has them. Throws AvatarError that names the line. */
export function* csvRows(text: string): Generator<Row> {
  let at = text.startsWith("\uFEFF") ? 1 : 0;
  let line = 1;
  while (at < text.length) {
    const row: Row = { line, fields: [] };
    let ended = false;
    while (!ended) {
      const field = text[at] === '"' ? quoted(text, at, line) : plain(text, at);
      row.fields.push(field.value);
      line += field.lines;
      at = field.end;
      ended = text[at] !== ",";
      at += ended ? 0 : 1;
    }
    at += text[at] === "\r" ? 1 : 0;
    at += text[at] === "\n" ? 1 : 0;
    line += 1;
    yield row.fields.length === 1 && row.fields[0] === "" ? { line: row.line, fields: [] } : row;
  }
}

interface Field {
  readonly value: string;
  readonly end: number; // the first letter behind it
  readonly lines: number; // ends of lines in it
}

function plain(text: string, at: number): Field {
  let end = at;
  while (end < text.length && text[end] !== "," && text[end] !== "\n" && text[end] !== "\r") end++;
  return { value: text.slice(at, end), end, lines: 0 };
}

function quoted(text: string, at: number, line: number): Field {
  let value = "";
  let end = at + 1;
  for (;;) {
    const close = text.indexOf('"', end);
    if (close < 0) throw new AvatarError(`line ${line}: a quotation mark is not closed`);
    value += text.slice(end, close);
    end = close + 1;
    if (text[end] !== '"') break;
    value += '"';
    end++;
  }
  if (end < text.length && !",\r\n".includes(text[end] as string)) {
    throw new AvatarError(`line ${line}: a comma is missing behind a quotation mark`);
  }
  return { value, end, lines: value.split("\n").length - 1 };
}
