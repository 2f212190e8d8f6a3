// The canvas: its WebGL context, which may be lost, and its size, which follows the page and the screen.

const SHARPEST = 2; // pixels of the canvas to one of the page, at most

export class Surface {
  /** `changed()` when it has to be drawn again, `restored()` when its context is a new one.
   *  @param {HTMLCanvasElement} canvas @param {() => void} changed @param {() => void} restored */
  constructor(canvas, changed, restored) {
    /** @type {WebGLContextAttributes} */
    const wanted = { antialias: true, powerPreference: "high-performance" };
    const gl = canvas.getContext("webgl2", wanted);
    if (!gl) throw new Error("webgl");
    this.canvas = canvas;
    this.gl = gl;
    if (!canvas.hasAttribute("tabindex")) canvas.tabIndex = 0;
    this.lost = false;
    this.off = new AbortController();
    this.watch = new ResizeObserver(changed);
    this.watch.observe(canvas);
    this.#listen(changed, restored);
  }

  get drawable() {
    return !this.lost && this.canvas.clientWidth > 0 && this.canvas.clientHeight > 0;
  }

  // Gives the canvas as many pixels as the screen has there, within reason; returns how many to one.
  fit() {
    const { canvas } = this;
    const ratio = Math.min(devicePixelRatio || 1, SHARPEST);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    return ratio;
  }

  /** @param {number[]} color */
  clear([red, green, blue]) {
    const { gl } = this;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(red, green, blue, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  dispose() {
    this.off.abort();
    this.watch.disconnect();
  }

  /** @param {() => void} changed @param {() => void} restored */
  #listen(changed, restored) {
    const { signal } = this.off;
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed, { signal });
    /** @param {Event} event */
    const lose = (event) => {
      event.preventDefault();
      this.lost = true;
    };
    const restore = () => {
      this.lost = false;
      restored();
    };
    this.canvas.addEventListener("webglcontextlost", lose, { signal });
    this.canvas.addEventListener("webglcontextrestored", restore, { signal });
  }
}
