// Reads reference vectors in any JavaScript engine. `text` is cases.json, `buffer` (ArrayBuffer) is vectors.safetensors.
const TYPES = { F64: Float64Array, F32: Float32Array, I64: BigInt64Array, I32: Int32Array };

export function readReference(text, buffer) {
  const size = Number(new DataView(buffer).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  const tensors = {};
  for (const [name, { dtype, data_offsets: [begin, end] }] of Object.entries(header))
    tensors[name] = new TYPES[dtype](buffer.slice(8 + size + begin, 8 + size + end)); // row-major, little-endian
  return { ...JSON.parse(text), tensors };
}

// The largest share of its tolerance that an element of `got` takes up: it holds if that is <= 1 (NaN is not).
export function toleranceUsed({ tensor, weight, atol, rtol }, got, tensors) {
  const want = tensors[tensor], weights = weight ? tensors[weight.tensor] : [1], width = want.length / weights.length;
  const share = (w, i) => Math.abs(got[i] - w) / (atol * weights[Math.floor(i / width)] + rtol * Math.abs(w));
  return want.reduce((most, w, i) => Math.max(most, got[i] === w ? 0 : share(w, i)), 0);
}
