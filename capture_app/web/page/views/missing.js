// An address that leads nowhere.
import { ApiError } from "../core/api.js";
import { troublePage } from "../parts/trouble.js";

export async function missing() {
  const error = new ApiError(404, { code: "page-missing", what: "There is no such page." });
  return { title: "Not here", node: troublePage(error) };
}
