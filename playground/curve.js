// The residual of the last steps on a logarithmic axis, with the tolerance as a line.
"use strict";

class Curve {
  constructor(canvas) {
    this.canvas = canvas;
    this.most = 300; // steps that are shown
    this.clear();
  }
  clear() {
    this.steps = [];
  }
  add(residual, tolerance, sound) {
    this.steps.push({ residual, tolerance, sound });
    if (this.steps.length > this.most) this.steps.shift();
  }

  draw(tolerance) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const pen = this.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "11px system-ui, sans-serif";
    // Powers of ten from 1e-12 up; a residual of zero is drawn at the bottom.
    const [low, high, left] = [-12, 0, 34];
    const y = (value) => {
      const power = Math.min(high, Math.max(low, Math.log10(Math.max(value, 1e-300))));
      return 6 + ((high - power) / (high - low)) * (height - 12);
    };
    const x = (k) => left + (k / (this.most - 1)) * (width - left);
    pen.fillStyle = styleOf("--faint");
    pen.strokeStyle = styleOf("--line");
    for (let power = low; power <= high; power += 3) {
      line(pen, [left, y(10 ** power)], [width, y(10 ** power)]);
      pen.fillText(power === 0 ? "1" : `1e${power}`, 0, y(10 ** power) + 4);
    }
    pen.strokeStyle = pen.fillStyle = styleOf("--warn");
    pen.setLineDash([5, 4]);
    line(pen, [left, y(tolerance)], [width, y(tolerance)]);
    pen.setLineDash([]);
    pen.strokeStyle = styleOf("--accent");
    pen.lineWidth = 1.5;
    pen.beginPath();
    this.steps.forEach(({ residual }, k) => pen.lineTo(x(k), y(residual)));
    pen.stroke();
    this.steps.forEach(({ residual, sound }, k) => sound || pen.fillRect(x(k) - 2, y(residual) - 2, 4, 4));
  }
}

function line(pen, from, to) {
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.stroke();
}
