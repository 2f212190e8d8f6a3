// What the server answers, as types: capture_app/web/routes/ says where each comes from.

/** @typedef {"sessions" | "objects" | "mounts" | "results"} Shelf */
/** A file to download. @typedef {{name: string, size: number, href: string}} Made */
/** What every thing of the library has; of a result that is asked for by itself, `files` are listed.
 *  @typedef {{id: string, name: string, created: string, size: number}} Item */
/** @typedef {Item & {files: number, app?: string, seconds?: number, verdict?: string}} Session */
/** @typedef {Item & {extents: number[], faces: number, vertices: number, warnings: string[],
 *    scale: number, scan?: {severity: Severity, checks: Check[]}}} Thing an object */
/** Within what a mount is true 95 times of 100. @typedef {{mm: number, deg: number}} Bounds */
/** @typedef {Item & {method: string, bounds: Bounds | null, found: string, sure: string[],
 *    warnings: string[], phone?: string, date?: string, object?: string | null}} Mount */
/** @typedef {Item & {session?: string | null, object?: string | null, mount?: string | null,
 *    parent?: string | null, object_name?: string, seconds?: number, samples: number,
 *    chosen?: number, video?: string | null, findings?: string[], faults?: string[], notes?: string[], grips?: string[]}} Motion */
/** @typedef {Motion & {manifest: Manifest, files: Made[], exports: Made[],
 *    unsolved: number[], video_job: string | null}} Result */
/** @typedef {{
 *    inputs: {role: string}[], options: Record<string, unknown>, correction: unknown,
 *    scores: Record<string, number>[], chosen: number, timings: Record<string, number>,
 *    body: {height: number, credit: string}, mount_method: string | null,
 *    versions: {omocap: string},
 *  }} Manifest */
/** What went wrong, and how to mend it.
 *  @typedef {{what: string, where?: string, fix?: string, code?: string}} Problem */
/** @typedef {{
 *    id: string, kind: string, name: string, state: string, stage: string, fraction: number,
 *    log: string[], timings: Record<string, number>, options: {video_size?: number[] | null},
 *    error: Problem | null, started: string | null, ended: string | null, waits?: string,
 *    made?: string | null, result?: string | null, files?: Made[], summary: {notes?: string[]},
 *  }} Job */
/** @typedef {"ok" | "warn" | "bad"} Severity */
/** @typedef {{name: string, severity: Severity, message: string, fix: string,
 *    frames: [number, number] | null, seconds: [number | null, number | null] | null}} Check */
/** @typedef {{
 *    verdict: string, reason: string, advice: string, app: string, animated: boolean,
 *    checks: Check[], segments: [number, number][], floor: string, facts: Facts,
 *  }} Report */
/** @typedef {{seconds: number | null, rate: number | null, stretches: number | null,
 *    longest: number | null}} Facts */
/** Its body in millimetres, and whether it is known where in it the lens is.
 *  @typedef {{name: string, width: number, height: number, lens_known: boolean}} Phone */
/** @typedef {{phones: Phone[], phone_points: string[], exports: {to: string, ups: string[], units: string[]}[],
 *    forms: Record<"run" | "resolve" | "render" | "overlay" | "export" | "scan", Described[]>}} Choices */
/** A field of a form, as capture_app/web/described_forms.py makes it of the API's description.
 *  @typedef {{name: string, kind: string, title: string, hint: string, group: "main" | "more" | "reading",
 *    unit?: string, value?: any, required?: boolean, min?: number, max?: number, step?: number,
 *    options: string[][], [more: string]: any}} Described */
/** @typedef {Record<string, {text: string}>} Boards */
/** A way to calibrate, as capture_app/web/calibration_forms.py describes it.
 *  @typedef {{title: string, hint: string, name: string, method: string, parts: {title: string, todo: string[],
 *    fields: Described[], more: string, more_fields: Described[]}[]}} WayDescribed */
/** @typedef {{ways: Record<string, WayDescribed>, boards: Boards}} Guide */
/** @typedef {{good: string, doubts: string[], notes: string[]}} Looked */
/** @typedef {{id: string, kind: string, name: string, size: number, received: number}} Unfinished */
/** How much of each file of an upload has arrived.
 *  @typedef {{id: string, files: Arrived[]}} Announced */
/** @typedef {{index: number, path: string, size: number, received: number}} Arrived */

export {};
