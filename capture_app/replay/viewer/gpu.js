// Programs, meshes and lines on the graphics card.

/** @typedef {WebGL2RenderingContext} Gl */
/** A vertex attribute. @typedef {{data: Data, width: number, normalized?: boolean}} Column */
/** @typedef {import("./pack.js").Numbers} Data */

export class Program {
  /** @param {Gl} gl @param {string} vertex @param {string} fragment */
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.handle = gl.createProgram();
    this.#attach(gl.VERTEX_SHADER, vertex);
    this.#attach(gl.FRAGMENT_SHADER, fragment);
    gl.linkProgram(this.handle);
    /** @type {Map<string, WebGLUniformLocation | null>} */
    this.places = new Map();
  }

  /** @param {number} kind @param {string} text */
  #attach(kind, text) {
    const { gl } = this;
    // Only a lost context makes no shader, and takes none.
    const shader = gl.createShader(kind);
    if (!shader) return;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(this.handle, shader);
    gl.deleteShader(shader);
  }

  check() {
    const { gl, handle } = this;
    if (gl.getProgramParameter(handle, gl.LINK_STATUS) || gl.isContextLost()) return;
    const logs = (gl.getAttachedShaders(handle) ?? []).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`shader: ${gl.getProgramInfoLog(handle)} ${logs.join(" ")}`);
  }

  /** @param {Record<string, number | number[] | Float32Array>} values */
  use(values) {
    this.gl.useProgram(this.handle);
    this.set(values);
  }

  /** Uniforms by name; the kind follows from the value.
   *  @param {Record<string, number | number[] | Float32Array>} values */
  set(values) {
    const { gl } = this;
    for (const [name, value] of Object.entries(values)) {
      const place = this.#place(name);
      if (place === null) continue;
      if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
      else if (value.length === 2) gl.uniform2fv(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else gl.uniform4fv(place, value);
    }
  }

  /** A sampler takes its texture from this unit of the card. @param {string} name @param {number} unit */
  unit(name, unit) {
    this.gl.useProgram(this.handle);
    this.gl.uniform1i(this.#place(name), unit);
  }

  /** @param {string} name */
  #place(name) {
    const known = this.places.get(name);
    if (known !== undefined) return known;
    const place = this.gl.getUniformLocation(this.handle, name);
    this.places.set(name, place);
    return place;
  }
}

export class Mesh {
  /** `columns` are vertex attributes in the order of their locations.
   *  @param {Gl} gl @param {Column[]} columns @param {import("./pack.js").Faces} indices */
  constructor(gl, columns, indices) {
    this.gl = gl;
    this.vertexArray = gl.createVertexArray();
    /** @type {WebGLBuffer[]} */
    this.buffers = [];
    gl.bindVertexArray(this.vertexArray);
    columns.forEach(({ data, width, normalized }, location) => {
      this.#buffer(gl.ARRAY_BUFFER, data);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, width, typeOf(gl, data), Boolean(normalized), 0, 0);
    });
    this.#buffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    this.count = indices.length;
    this.type = typeOf(gl, indices);
    gl.bindVertexArray(null);
  }

  draw() {
    this.gl.bindVertexArray(this.vertexArray);
    this.gl.drawElements(this.gl.TRIANGLES, this.count, this.type, 0);
  }

  dispose() {
    this.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
    this.gl.deleteVertexArray(this.vertexArray);
  }

  /** @param {number} target @param {Data} data */
  #buffer(target, data) {
    const buffer = this.gl.createBuffer();
    this.buffers.push(buffer);
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
  }
}

/** The unit of the card on which the bones lie. */
export const BONES_UNIT = 2;

/** How joints bend a surface: three rows of a matrix each, of as many joints as a texture is high. */
export class Bones {
  /** @param {Gl} gl */
  constructor(gl) {
    this.gl = gl;
    this.texture = gl.createTexture();
    this.#bind();
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    }
  }

  /** @param {Float32Array} rows twelve numbers a joint */
  set(rows) {
    const { gl } = this;
    this.#bind();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 3, rows.length / 12, 0, gl.RGBA, gl.FLOAT, rows);
  }

  dispose() {
    this.gl.deleteTexture(this.texture);
  }

  #bind() {
    this.gl.activeTexture(this.gl.TEXTURE0 + BONES_UNIT);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.texture);
  }
}

const PIECE = 10;

export class Lines {
  /** @param {Gl} gl */
  constructor(gl) {
    this.gl = gl;
    this.buffer = gl.createBuffer();
    this.vertexArray = gl.createVertexArray();
    this.count = 0;
    gl.bindVertexArray(this.vertexArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    [3, 3, 4].forEach((width, location) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, width, gl.FLOAT, false, 4 * PIECE, [0, 12, 24][location]);
      gl.vertexAttribDivisor(location, 1);
    });
    gl.bindVertexArray(null);
  }

  /** Pieces of ten numbers: from, to, colour with opacity. @param {number[]} pieces */
  set(pieces) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, new Float32Array(pieces), this.gl.DYNAMIC_DRAW);
    this.count = pieces.length / PIECE;
    return this;
  }

  /** @param {number} count */
  draw(count = this.count) {
    this.gl.bindVertexArray(this.vertexArray);
    this.gl.drawArraysInstanced(this.gl.TRIANGLE_STRIP, 0, 4, Math.min(count, this.count));
  }

  dispose() {
    this.gl.deleteBuffer(this.buffer);
    this.gl.deleteVertexArray(this.vertexArray);
  }
}

/** @param {Gl} gl @param {Data} data */
function typeOf(gl, data) {
  if (data instanceof Float32Array) return gl.FLOAT;
  if (data instanceof Int8Array) return gl.BYTE;
  if (data instanceof Uint8Array) return gl.UNSIGNED_BYTE;
  if (data instanceof Uint16Array) return gl.UNSIGNED_SHORT;
  return gl.UNSIGNED_INT;
}
