// What goes on: the queue, the link's figures, the log, what the arm is.

import { button, el, field, fill, fixed, say } from "../dom.js";

const FIGURES = ["round_trip", "requests", "repeated", "lost", "junk", "outages", "why"];

export function statusPart(app) {
  const { texts } = app;
  const queue = el("ol.queue");
  const pending = el("p.hint");
  const link = el("dl.facts");
  const about = el("dl.facts");
  const name = field(texts.about.name, { maxlength: 30 });
  const rename = button(texts.about.rename, () => name.input.value.trim() && app.act("name", { name: name.input.value.trim() }));
  const log = el("ol.log", { "aria-label": texts.log.title, tabindex: 0 });
  const card = (title, ...content) => el("section.card", { "aria-label": title }, el("h2", {}, title), content);
  const element = el("div.cards", {}, card(texts.queue.title, queue, pending), card(texts.link.label, link), card(texts.log.title, log), card(texts.about.title, about, el("div.row", {}, name.row, rename)));
  const facts = rows => rows.map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value)));

  const showQueue = () => {
    const { items, pending: count } = app.arm?.queue ?? { items: [], pending: 0 };
    fill(queue, items.map(item => el("li", { "data-state": item.state },
      el("span", {}, item.text), el("small", {}, [texts.queue[item.state], item.by && texts.queue.by(item.by)].filter(Boolean).join(" ")),
      Number.isFinite(item.progress) && el("progress", { max: 1, value: item.progress, "aria-label": item.text }))));
    say(pending, [items.length ? "" : texts.queue.empty, count ? texts.queue.pending(count) : ""].filter(Boolean).join(" "));
  };

  const showLink = () => {
    const known = app.arm?.link ?? {};
    const value = name => (name === "round_trip" ? (Number.isFinite(known[name]) ? texts.link.trip(known[name]) : "–") : Number.isFinite(known[name]) ? fixed(known[name], 0) : known[name]);
    fill(link, facts([[texts.link.rows.state, texts.link[known.state] ?? "–"], ...FIGURES.filter(name => known[name] !== undefined && known[name] !== "").map(name => [texts.link.rows[name], value(name)])]));
  };

  const showAbout = () => {
    const { arm, model } = app;
    fill(about, arm && facts([[texts.about.title, arm.info.title], [texts.about.family, arm.info.family], [texts.about.model, arm.info.model || "–"], [texts.about.jogs, arm.info.jogs_at], [texts.about.you, model.you], [texts.about.version, model.version]]));
  };

  const line = entry => el("li", { "data-level": entry.level }, el("time", {}, new Date(entry.time * 1000).toLocaleTimeString()), el("span", {}, entry.text));
  const showLog = all => {
    const bottom = log.scrollHeight - log.scrollTop - log.clientHeight < 40;
    if (all) fill(log, app.model.log.length ? app.model.log.map(line) : el("li", {}, texts.log.empty));
    else {
      if (app.model.log.length === 1) fill(log);
      log.append(line(app.model.log.at(-1)));
      while (log.children.length > app.model.log.length) log.firstChild.remove();
    }
    if (bottom) log.scrollTop = log.scrollHeight;
  };

  return {
    element,
    update(topic) {
      if (topic === "select") {
        showAbout();
        showLog(true);
      }
      if (topic === "log") showLog(false);
      if (topic === "queue" || topic === "select") showQueue();
      if (topic === "link" || topic === "select") showLink();
    },
  };
}
