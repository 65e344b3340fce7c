// Reads the tensors of a .safetensors file in any JavaScript: its bytes (ArrayBuffer) give {name: typed array, row-major}.
export function readTensors(buffer) {
  const types = { F64: Float64Array, F32: Float32Array, I64: BigInt64Array, I32: Int32Array, U32: Uint32Array, U16: Uint16Array };
  const size = Number(new DataView(buffer).getBigUint64(0, true)), text = new TextDecoder().decode(new Uint8Array(buffer, 8, size));
  const array = ({ dtype, data_offsets: [begin, end] }) => new types[dtype](buffer.slice(8 + size + begin, 8 + size + end));
  return Object.fromEntries(Object.entries(JSON.parse(text)).map(([name, entry]) => [name, array(entry)]));
}
export const readReference = (casesJson, vectors) => ({ ...JSON.parse(casesJson), tensors: readTensors(vectors) });
// Whether `got`, all numbers of one output, is within the tolerance of that output. `drawnInOne(row)` is true where either
// the port or the reference draws a row and the other does not; `brightest` is the brightest colour, at least 1.
export function holds({ tensor, shape, weight, atol, rtol, flips, most_flips }, got, tensors, drawnInOne = () => 0, brightest = 1) {
  const want = Array.from(tensors[tensor], Number), width = want.length / shape[0], scale = weight && tensors[weight.tensor];
  return got.length === want.length && [...Array(shape[0]).keys()].every((row) => {
    const pairs = want.slice(row * width, row * width + width).map((w, k) => [Number(got[row * width + k]), w]);
    const near = (s) => pairs.every(([g, w]) => Math.abs(s * g - w) <= atol * (scale ? scale[row] : 1) + rtol * Math.abs(w));
    const off = Math.max(...pairs.map(([g, w]) => Math.abs(g - w))), one = off === 1 || (off < Infinity && pairs[0].includes(0));
    // A radius may differ by one, or be 0 on one side only; at the edge of a shadow any value may be right.
    const flipped = flips === "shadow" || (flips === "drawn" ? one : flips === "cutoff" && off <= 4e-3 * brightest);
    return (flips !== "drawn" && drawnInOne(row)) || near(1) || (flips === "sign" && near(-1)) || (flipped && most_flips-- > 0);
  });
}
