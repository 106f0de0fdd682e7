// A flat picture on a canvas: millimetres to pixels and back, and the few strokes that flat pictures are made of.

export class Plan {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
  }

  /** Fit an area of mm into a rectangle of CSS px; the first axis to the right, the second up. */
  fit([x0, x1], [y0, y1], [left, top, width, height]) {
    this.scale = Math.min(width / (x1 - x0), height / (y1 - y0));
    this.left = left + width / 2 - (this.scale * (x0 + x1)) / 2;
    this.bottom = top + height / 2 + (this.scale * (y0 + y1)) / 2;
  }

  /** Make the canvas as large as it is shown, and wipe it. */
  begin(paper) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.fillStyle = paper;
    this.pen.fillRect(0, 0, width, height);
    return [width, height];
  }

  px([x, y]) {
    return [this.left + this.scale * x, this.bottom - this.scale * y];
  }

  mm([left, top]) {
    return [(left - this.left) / this.scale, (this.bottom - top) / this.scale];
  }

  path(points, close = false) {
    this.pen.beginPath();
    for (const point of points) this.pen.lineTo(...this.px(point));
    if (close) this.pen.closePath();
  }

  line(points, color, width = 1.5, dash = []) {
    this.path(points);
    Object.assign(this.pen, { strokeStyle: color, lineWidth: width, lineJoin: "round", lineCap: "round" });
    this.pen.setLineDash(dash);
    this.pen.stroke();
    this.pen.setLineDash([]);
  }

  area(points, color, opacity = 1) {
    this.path(points, true);
    this.pen.globalAlpha = opacity;
    this.pen.fillStyle = color;
    this.pen.fill();
    this.pen.globalAlpha = 1;
  }

  dot(point, color, radius) {
    this.pen.beginPath();
    this.pen.arc(...this.px(point), radius, 0, 2 * Math.PI);
    this.pen.fillStyle = color;
    this.pen.fill();
  }

  text(words, [left, top], color) {
    this.pen.font = "12px system-ui, sans-serif";
    this.pen.fillStyle = color;
    this.pen.fillText(words, left, top);
  }

  /** Lines every so many mm. */
  grid([x0, x1], [y0, y1], step, color) {
    for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) this.line([[x, y0], [x, y1]], color, 1);
    for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) this.line([[x0, y], [x1, y]], color, 1);
  }
}

/** The outline of what an arm reaches, seen from above, from its two radii. */
export function sector(reach, about = [0, 0], yaw = 0) {
  const [from, to] = (reach.sector ?? [-180, 180]).map(angle => ((angle + yaw) * Math.PI) / 180);
  const arc = (radius, a, b) => Array.from({ length: 49 }, (_, n) => {
    const angle = a + ((b - a) * n) / 48;
    return [about[0] + radius * Math.cos(angle), about[1] + radius * Math.sin(angle)];
  });
  return [...arc(reach.outer, from, to), ...arc(Math.max(reach.inner, 0.1), to, from)];
}

/** The four corners of a box that is turned. */
export function corners([x, y], [length, width], yaw = 0) {
  const [c, s] = [Math.cos((yaw * Math.PI) / 180), Math.sin((yaw * Math.PI) / 180)];
  return [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([a, b]) => {
    const [dx, dy] = [(a * length) / 2, (b * width) / 2];
    return [x + c * dx - s * dy, y + s * dx + c * dy];
  });
}
