// Reads reference vectors in any JavaScript. `text` is cases.json, `buffer` (ArrayBuffer) is vectors.safetensors.
export function readReference(text, buffer) {
  const types = { F64: Float64Array, F32: Float32Array, I64: BigInt64Array, I32: Int32Array };
  const size = Number(new DataView(buffer).getBigUint64(0, true)), tensors = {};
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  for (const [name, { dtype, data_offsets: [begin, end] }] of Object.entries(header))
    tensors[name] = new types[dtype](buffer.slice(8 + size + begin, 8 + size + end)); // row-major, little-endian
  return { ...JSON.parse(text), tensors };
}
// Whether `got`, all numbers of an output, holds. `apart(row)`: drawn in one alone; `rgb`: the brightest, at least 1.
export function holds({ tensor, shape, weight, atol, rtol, flips, most_flips }, got, tensors, apart = () => 0, rgb = 1) {
  const want = Array.from(tensors[tensor], Number), width = want.length / shape[0], scale = weight && tensors[weight.tensor];
  return got.length === want.length && [...Array(shape[0]).keys()].every((row) => {
    const pairs = want.slice(row * width, row * width + width).map((w, k) => [Number(got[row * width + k]), w]);
    const near = (s) => pairs.every(([g, w]) => Math.abs(s * g - w) <= atol * (scale ? scale[row] : 1) + rtol * Math.abs(w));
    const off = Math.max(...pairs.map(([g, w]) => Math.abs(g - w))), flipped = // a radius may be one off, or 0 in one alone
      flips === "drawn" ? off === 1 || (off < Infinity && pairs[0].includes(0)) : flips === "cutoff" && off <= 4e-3 * rgb;
    return (flips !== "drawn" && apart(row)) || near(1) || (flips === "sign" && near(-1)) || (flipped && most_flips-- > 0);
  });
}
