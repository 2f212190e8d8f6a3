// The token that a server beyond this computer asks for.
import { api } from "../core/api.js";
import { h, inRow } from "../core/dom.js";
import { field, sends } from "./fields.js";

/** A page that asks for the token; `entered()` when it was right. @param {() => void} entered */
export function login(entered) {
  const token = h("input", { type: "password", required: true, autocomplete: "current-password" });
  const problem = h("div");
  const button = h("button", { type: "submit", class: "main" }, "Go on");
  return h(
    "form",
    {
      class: "narrow stack",
      ...sends(button, problem, async () => {
        await api("/api/login", { json: { token: token.value } });
        entered();
      }),
    },
    h("h1", {}, "This omocap asks for its token"),
    h("p", {}, "It is what omocap serve printed when it was started."),
    field("Token", token),
    inRow(button),
    problem,
  );
}
