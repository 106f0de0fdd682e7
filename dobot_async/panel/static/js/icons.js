// Line icons of 24 px, as paths.

const PATHS = {
  jog: "M12 3v18M3 12h18M12 3l-3 3M12 3l3 3M12 21l-3-3M12 21l3-3M3 12l3-3M3 12l3 3M21 12l-3-3M21 12l-3 3",
  go: "M12 21s-6-5.5-6-11a6 6 0 0 1 12 0c0 5.5-6 11-6 11zM12 8v4M10 10h4",
  tools: "M14.5 6a4 4 0 0 0-5 5L4 16.5 7.5 20 13 14.5a4 4 0 0 0 5-5L15.5 12 12 8.5z",
  teach: "M5 6h.01M5 12h.01M5 18h.01M9 6h11M9 12h11M9 18h11",
  draw: "M4 20l1-5L16 4l4 4L9 19zM14 6l4 4",
  status: "M3 12h4l3-8 4 16 3-8h4",
  up: "M12 19V5M6 11l6-6 6 6",
  down: "M12 5v14M6 13l6 6 6-6",
  left: "M19 12H5M11 6l-6 6 6 6",
  right: "M5 12h14M13 6l6 6-6 6",
  cw: "M19 12a7 7 0 1 1-2-5M19 3v5h-5",
  ccw: "M5 12a7 7 0 1 0 2-5M5 3v5h5",
  plus: "M12 5v14M5 12h14",
  minus: "M5 12h14",
  edit: "M4 20l1-5L16 4l4 4L9 19z",
  remove: "M5 7h14M10 7V4h4v3M7 7l1 13h8l1-13",
  home: "M4 11l8-7 8 7M6 10v10h12V10",
  pause: "M8 5v14M16 5v14",
  play: "M7 4l13 8-13 8z",
  sun: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8zM12 2v3M12 19v3M2 12h3M19 12h3M5 5l2 2M17 17l2 2M5 19l2-2M17 7l2-2",
  moon: "M20 14A8 8 0 1 1 10 4a6.5 6.5 0 0 0 10 10z",
  alarm: "M12 3l10 18H2zM12 10v5M12 18h.01",
  eye: "M2 12s4-7 10-7 10 7 10 7-4 7-10 7S2 12 2 12zM12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6z",
  reset: "M4 9V4h5M20 15v5h-5M20 9V4h-5M4 15v5h5",
  eraser: "M8 20h12M5 15l8-9 6 5-7 8H8z",
  power: "M12 3v9M6.5 7a8 8 0 1 0 11 0",
};

/** An icon that says nothing to screen readers: its button does. */
export function icon(name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  svg.setAttribute("class", "icon");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", PATHS[name]);
  svg.append(path);
  return svg;
}
