// Arrays as the page holds them (report/encoding.py): base64 of little-endian numbers, read row by row.

function bytesOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

const TYPES = { f8: Float64Array, f4: Float32Array, u2: Uint16Array, u1: Uint8Array };

/** An array (n, ...); where all rows are alike only one is kept. */
class Numbers {
  constructor(packed) {
    this.shape = packed.shape;
    this.once = packed.once;
    this.width = packed.shape.slice(1).reduce((product, size) => product * size, 1);
    this.values = new TYPES[packed.kind](bytesOf(packed.data).buffer);
  }

  /** One row, or `count` numbers of it. */
  row(i, from = 0, count = this.width) {
    const start = (this.once ? 0 : i * this.width) + from;
    return this.values.subarray(start, start + count);
  }

  get(i, j = 0) {
    return this.values[(this.once ? 0 : i * this.width) + j];
  }

  /** Column j over all rows. */
  column(j = 0) {
    return Float64Array.from({ length: this.shape[0] }, (_, i) => this.get(i, j));
  }
}

/** Coefficients (n, m, L): the zero harmonic, and six-byte steps of a scale for the others. */
class Coefficients {
  constructor(packed) {
    this.zero = new Numbers(packed.zero);
    this.scale = new Numbers(packed.scale);
    this.width = packed.rest.shape[2];
    this.many = packed.rest.shape[1];
    this.once = packed.rest.once;
    this.bytes = new DataView(bytesOf(packed.rest.data).buffer);
  }

  row(i, m) {
    const out = new Float64Array(this.width + 1), scale = this.scale.get(i, m);
    out[0] = this.zero.get(i, m);
    let at = 6 * this.width * ((this.once ? 0 : i * this.many) + m);
    for (let k = 1; k <= this.width; k++, at += 6) {
      out[k] = (this.bytes.getInt16(at + 4, true) * 4294967296 + this.bytes.getUint32(at, true)) * scale;
    }
    return out;
  }
}
