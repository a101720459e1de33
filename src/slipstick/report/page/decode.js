// Arrays as the page holds them (report/encoding.py): one deflated store of little-endian numbers, read row by row.

const STORE = { buffer: null };

/** The store, from its text in base64. */
async function inflated(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

const TYPES = { f8: Float64Array, f4: Float32Array, u2: Uint16Array, u1: Uint8Array };

/** Numbers of so many bytes each from their planes: the first bytes of all, the second ones, and so on. */
function unplaned([from, to], width) {
  const planes = new Uint8Array(STORE.buffer, from, to - from), count = planes.length / width, bytes = new Uint8Array(planes.length);
  for (let b = 0; b < width; b++) for (let i = 0; i < count; i++) bytes[i * width + b] = planes[b * count + i];
  return bytes;
}

/** An array (n, ...); where all rows are alike only one is kept. */
class Numbers {
  constructor(packed) {
    this.shape = packed.shape;
    this.once = packed.once;
    this.width = packed.shape.slice(1).reduce((product, size) => product * size, 1);
    this.values = new TYPES[packed.kind](unplaned(packed.bytes, TYPES[packed.kind].BYTES_PER_ELEMENT).buffer);
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

/** Coefficients (n, m, L): the mean, and whole numbers of so many bytes, in steps of a scale, for the others. */
class Coefficients {
  constructor(packed) {
    this.zero = new Numbers(packed.zero);
    this.scale = new Numbers(packed.scale);
    [, this.many, this.width] = packed.rest.shape;
    this.once = packed.rest.once;
    this.size = Number(packed.rest.kind.slice(1));
    this.bytes = unplaned(packed.rest.bytes, this.size);
  }

  row(i, m) {
    const out = new Float64Array(this.width + 1), scale = this.scale.get(i, m), { size, bytes } = this;
    out[0] = this.zero.get(i, m);
    let at = size * this.width * ((this.once ? 0 : i * this.many) + m);
    for (let k = 1; k <= this.width; k++, at += size) {
      let whole = (bytes[at + size - 1] << 24) >> 24; // the highest byte has the sign
      for (let b = size - 2; b >= 0; b--) whole = whole * 256 + bytes[at + b];
      out[k] = whole * scale;
    }
    return out;
  }
}
