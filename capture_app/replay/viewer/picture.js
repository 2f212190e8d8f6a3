// The picture on an object's surface, on the graphics card once the browser has decoded it.

/** The unit of the card on which every solid's picture lies; the shadow map has unit 0. */
export const UNIT = 1;
const KINDS = /** @type {const} */ ([
  ["object_png", "image/png"],
  ["object_jpg", "image/jpeg"],
]);

export class Picture {
  /** The object's picture; null where it has none. `changed()` when it can be drawn.
   *  @param {WebGL2RenderingContext} gl @param {import("./pack.js").Pack} pack
   *  @param {() => void} changed */
  static of(gl, pack, changed) {
    for (const [name, type] of KINDS) {
      const bytes = pack.array(name);
      if (bytes) return new Picture(gl, new Blob([bytes], { type }), changed);
    }
    return null;
  }

  /** @param {WebGL2RenderingContext} gl @param {Blob} file @param {() => void} changed */
  constructor(gl, file, changed) {
    this.gl = gl;
    /** @type {WebGLTexture | null} */
    this.texture = gl.createTexture();
    this.ready = false;
    this.#decode(file).then(changed, () => {});
  }

  dispose() {
    this.gl.deleteTexture(this.texture);
    this.texture = null;
  }

  bind() {
    this.gl.activeTexture(this.gl.TEXTURE0 + UNIT);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.texture);
  }

  /** @param {Blob} file */
  async #decode(file) {
    const { gl } = this;
    const image = await createImageBitmap(file, { premultiplyAlpha: "none" });
    if (!this.texture) return; // it was disposed of meanwhile
    this.bind();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    image.close();
    this.ready = true;
  }
}
