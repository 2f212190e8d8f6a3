// Draws: the shadow first, then floor, surfaces and lines of each pane.

import { Bones, BONES_UNIT, Mesh, Program } from "./gpu.js";
import { UNIT } from "./picture.js";
import * as shaders from "./shaders.js";
/** @import {Lines} from "./gpu.js"
 *  @import {Theme} from "./palette.js"
 *  @import {Picture} from "./picture.js" */
import { lookAt, multiply, parallel, rigidInverse } from "./vectors.js";

const SHADOW_SIZE = 2048;
const ELEVATION = 0.9;
const BLUR = 0.04;
const FLOOR_SIDES = 48;

/** A surface to draw: where it is (`place`) or how it is bent (`bones`), and its looks.
 *  @typedef {{mesh: Mesh, place?: Float32Array, bones?: Float32Array, color: number[], sheen: number,
 *    casts?: boolean, picture?: Picture | null, cutoff?: number}} Solid */
/** @typedef {{lines: Lines, count?: number, width: number}} Stroke */
/** What one slot shows. @typedef {{solids: Solid[], strokes: Stroke[]}} Scene */
/** @typedef {{x: number, y: number, width: number, height: number}} Box */
/** @typedef {import("./camera.js").View & {ratio: number}} View */
/** @typedef {Record<string, boolean>} Layers */
/** @typedef {Record<string, number | number[] | Float32Array>} Uniforms */

export class Stage {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    const lit = shaders.MESH_FRAGMENT;
    this.programs = {
      skinned: new Program(gl, shaders.SKINNED_VERTEX, lit),
      rigid: new Program(gl, shaders.RIGID_VERTEX, lit),
      skinnedDepth: new Program(gl, shaders.SKINNED_VERTEX, shaders.DEPTH_FRAGMENT),
      rigidDepth: new Program(gl, shaders.RIGID_VERTEX, shaders.DEPTH_FRAGMENT),
      floor: new Program(gl, shaders.FLOOR_VERTEX, shaders.FLOOR_FRAGMENT),
      line: new Program(gl, shaders.LINE_VERTEX, shaders.LINE_FRAGMENT),
    };
    Object.values(this.programs).forEach((program) => program.check());
    const { skinned, rigid, skinnedDepth } = this.programs;
    for (const program of [skinned, rigid]) program.unit("picture", UNIT);
    for (const program of [skinned, skinnedDepth]) program.unit("bones", BONES_UNIT);
    this.bones = new Bones(gl);
    this.floor = disc(gl);
    this.shadow = gl.createTexture();
    this.target = gl.createFramebuffer();
    this.#makeShadow();
  }

  /** `pane`: in pixels from the bottom left; `scenes` of the slots that it shows.
   *  @param {Box} pane @param {View} view @param {Scene[]} scenes @param {Theme} theme
   *  @param {Layers} layers */
  draw(pane, view, scenes, theme, layers) {
    const solids = scenes.flatMap((scene) => scene.solids);
    const lightMatrix = this.#shade(solids, view, layers.shadow);
    const { gl } = this;
    gl.viewport(pane.x, pane.y, pane.width, pane.height);
    gl.scissor(pane.x, pane.y, pane.width, pane.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.DEPTH_TEST);
    const [red, green, blue] = theme.background;
    gl.clearColor(red, green, blue, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const viewProjection = multiply(view.projection, rigidInverse(view.T_world_camera));
    const light = this.#light(theme, lightMatrix, layers, view.sun);
    this.#drawFloor({ viewProjection, ...light }, view, theme, layers);
    const eye = view.T_world_camera.subarray(12, 15);
    const { skinned, rigid } = this.programs;
    this.#drawSolids(solids, skinned, rigid, { viewProjection, eye, ...light });
    const strokes = scenes.flatMap((scene) => scene.strokes);
    this.#drawLines(strokes, viewProjection, pane, view.ratio);
    gl.disable(gl.SCISSOR_TEST);
  }

  dispose() {
    Object.values(this.programs).forEach(({ handle }) => this.gl.deleteProgram(handle));
    this.floor.dispose();
    this.bones.dispose();
    this.gl.deleteTexture(this.shadow);
    this.gl.deleteFramebuffer(this.target);
  }

  #makeShadow() {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.shadow);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
    for (const [name, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.LINEAR],
      [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE],
      [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL],
    ]) {
      gl.texParameteri(gl.TEXTURE_2D, name, value);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadow, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** What the sun sees, from where it stands above the middle of the scene.
   *  @param {Solid[]} solids @param {View} view @param {boolean} wanted */
  #shade(solids, view, wanted) {
    const { gl } = this;
    const eye = sun(view.sun).map((s, k) => view.focus[k] + 2 * s * view.spread);
    const seen = parallel(view.spread, 4 * view.spread);
    const lightMatrix = multiply(seen, rigidInverse(lookAt(eye, view.focus)));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    const casting = wanted ? solids.filter((solid) => solid.casts) : [];
    const { skinnedDepth, rigidDepth } = this.programs;
    this.#drawSolids(casting, skinnedDepth, rigidDepth, { viewProjection: lightMatrix });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return lightMatrix;
  }

  /** @param {Theme} theme @param {Float32Array} lightMatrix @param {Layers} layers @param {number} azimuth */
  #light(theme, lightMatrix, layers, azimuth) {
    this.gl.activeTexture(this.gl.TEXTURE0);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.shadow);
    const { sky, ground } = theme;
    return {
      toSun: sun(azimuth),
      sun: theme.sun / Math.sin(ELEVATION),
      sky,
      ground,
      lightMatrix,
      blur: BLUR,
      shadows: layers.shadow ? 1 : 0,
    };
  }

  /** @param {Uniforms} shared @param {View} view @param {Theme} theme @param {Layers} layers */
  #drawFloor(shared, view, theme, layers) {
    const { tile, background, line } = theme;
    this.programs.floor.use({
      ...shared,
      centre: view.focus,
      reach: view.reach,
      tile,
      background,
      line,
      grid: layers.grid ? 1 : 0,
    });
    this.floor.draw();
  }

  /** @param {Solid[]} solids @param {Program} skinned @param {Program} rigid
   *  @param {Uniforms} shared */
  #drawSolids(solids, skinned, rigid, shared) {
    draw(skinned, solids.filter((solid) => solid.bones), shared, this.bones);
    draw(rigid, solids.filter((solid) => !solid.bones), shared, this.bones);
  }

  /** @param {Stroke[]} strokes @param {Float32Array} viewProjection @param {Box} pane @param {number} ratio */
  #drawLines(strokes, viewProjection, pane, ratio) {
    const { gl } = this;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const { lines, count, width } of strokes) {
      this.programs.line.use({
        viewProjection,
        pane: [pane.width, pane.height],
        width: width * ratio,
      });
      lines.draw(count);
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
}

/** @param {Program} program @param {Solid[]} solids @param {Uniforms} shared @param {Bones} bent */
function draw(program, solids, shared, bent) {
  if (!solids.length) return;
  program.use(shared);
  let last = null;
  for (const { mesh, bones, place, color, sheen, picture, cutoff = 0 } of solids) {
    const painted = picture?.ready ? 1 : 0;
    picture?.bind();
    if (bones && bones !== last) bent.set(bones);
    last = bones;
    program.set({ ...(place && { place }), color, sheen, painted, cutoff });
    mesh.draw();
  }
}

/** @param {number} azimuth */
function sun(azimuth) {
  const level = Math.cos(ELEVATION);
  return [level * Math.cos(azimuth), level * Math.sin(azimuth), Math.sin(ELEVATION)];
}

/** @param {WebGL2RenderingContext} gl */
function disc(gl) {
  const vertices = [0, 0, 0];
  const faces = [];
  for (let k = 0; k < FLOOR_SIDES; k++) {
    const angle = (2 * Math.PI * k) / FLOOR_SIDES;
    vertices.push(Math.cos(angle), Math.sin(angle), 0);
    faces.push(0, k + 1, ((k + 1) % FLOOR_SIDES) + 1);
  }
  return new Mesh(gl, [{ data: new Float32Array(vertices), width: 3 }], new Uint16Array(faces));
}
