// A pack in parts: the header's JSON, the document, the bytes of the tensors.
import { gunzipSync, gzipSync } from "node:zlib";

export function taken(file) {
  const data = gunzipSync(file);
  const end = 8 + Number(data.readBigUInt64LE(0));
  const header = JSON.parse(data.subarray(8, end));
  return { header, document: JSON.parse(header.__metadata__.pack), body: data.subarray(end) };
}

/** The file of such parts. */
export function put({ header, document, body }) {
  const text = Buffer.from(JSON.stringify({ ...header, __metadata__: { pack: JSON.stringify(document) } }));
  const length = Buffer.alloc(8);
  length.writeBigUInt64LE(BigInt(text.length));
  return gzipSync(Buffer.concat([length, text, body]), { level: 1 });
}

/** A file with its parts changed. */
export function repacked(file, change) {
  const pack = taken(file);
  change(pack);
  return put(pack);
}
