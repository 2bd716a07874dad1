/* A finger that nobody holds: its generated equations of motion between the stops of its joints, in small steps. */
"use strict";

const STEP = 2.5e-5; // s
const STOP = 2 * Math.PI * 60; // rad/s: a joint's own inertia on its stop, critically damped
const CALM = 0.25; // s, in which every joint loses its speed to 1/e

class Fall {
  constructor(kernels, finger, q, gravity) {
    Object.assign(this, { kernels, finger, gravity, q: [...q], qd: q.map(() => 0) });
    const M = rowsOf(kernels[`${finger.name}_mass_matrix`](finger.middle).M, q.length);
    this.inertia = M.map((row, i) => row[i]);
    this.strings = kernels[`${finger.name}_return_torque`];
  }

  step() {
    const { finger, q, qd } = this;
    const tau = this.strings ? this.strings(q).tau : q.map(() => 0);
    for (let i = 0; i < q.length; i++) {
      const { low, high } = finger.joints[i];
      const over = q[i] < low ? q[i] - low : q[i] > high ? q[i] - high : 0;
      if (over) tau[i] -= this.inertia[i] * STOP * (STOP * over + 2 * qd[i]);
    }
    const { qdd } = this.kernels[`${finger.name}_forward_dynamics`](q, qd, tau, this.gravity);
    for (let i = 0; i < q.length; i++) {
      qd[i] += STEP * (qdd[i] - qd[i] / CALM);
      q[i] += STEP * qd[i];
    }
  }

  /* Run for a time [s]. */
  run(time) {
    for (let left = Math.round(time / STEP); left > 0; left--) this.step();
  }
}
