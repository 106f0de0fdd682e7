// The colours of the picture, from the page's style sheet, so that a theme is written once.

const NAMES = ["view-sky", "view-grid", "view-ink", "view-reach", "view-target", "view-zone", "view-draw", "view-block", "view-belt", "view-sensor",
  "view-x", "view-y", "arm-1", "arm-2", "arm-3", "arm-4", "view-joint"];
const WORDS = { red: "#d94a3d", green: "#3a9d54", blue: "#3b76d6", yellow: "#d9a514", grey: "#9aa3ad", gray: "#9aa3ad", white: "#e9ecef", black: "#30353b",
  orange: "#dd7a22", purple: "#8457c0", brown: "#8a6242" };

export function viewColors() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(NAMES.map(name => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** The colour of an arm by its number. */
export const armColor = (colors, number) => colors[`arm-${(number % 4) + 1}`];

/** The colour of a piece that is called by a word; a word that is not known is grey. */
export const pieceColor = word => WORDS[word] ?? WORDS.grey;
