// Files go to the server by POST; what is wrong with them comes back in words.

import { Failure } from "./connection.js";
import { texts } from "./texts.js";

/** Send a file; returns what the server says of it, or throws a Failure. */
export async function upload(path, values, file) {
  let answer;
  try {
    answer = await fetch(`${path}?${new URLSearchParams(values)}`, { method: "POST", body: file, headers: { "Content-Type": "application/octet-stream" } });
  } catch {
    throw new Failure("link", texts.connection.lostText);
  }
  const content = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Failure(content.error?.kind ?? "file", content.error?.text ?? `HTTP ${answer.status}`);
  return content;
}
