/* Small matrices: poses are 16 numbers row by row, others are arrays of rows. */
"use strict";

const rowsOf = (numbers, width) =>
  Array.from({ length: numbers.length / width }, (_, row) => numbers.slice(row * width, (row + 1) * width));

const times = (A, B) => A.map((row) => B[0].map((_, j) => row.reduce((sum, each, k) => sum + each * B[k][j], 0)));

const transposed = (A) => A[0].map((_, j) => A.map((row) => row[j]));

const identity = (n) => Array.from({ length: n }, (_, i) => Array.from({ length: n }, (_, j) => Number(i === j)));

const posed = (pose, p) => [0, 1, 2].map((i) => pose[i][0] * p[0] + pose[i][1] * p[1] + pose[i][2] * p[2] + pose[i][3]);

/* v in the axes of a pose, from those in which the pose is given. */
const turnedBack = (pose, v) => [0, 1, 2].map((j) => pose[0][j] * v[0] + pose[1][j] * v[1] + pose[2][j] * v[2]);

/* Eigenvalues of a symmetric matrix, the largest first, with their unit vectors: Jacobi's rotations. */
function eigen(matrix) {
  const n = matrix.length;
  const A = matrix.map((row) => [...row]);
  const V = identity(n);
  for (let sweep = 0; sweep < 30; sweep++) {
    for (let p = 0; p < n; p++) {
      for (let q = p + 1; q < n; q++) {
        if (A[p][q] === 0) continue;
        const t = 0.5 * Math.atan2(2 * A[p][q], A[q][q] - A[p][p]);
        const [c, s] = [Math.cos(t), Math.sin(t)];
        for (let k = 0; k < n; k++) [A[k][p], A[k][q]] = [c * A[k][p] - s * A[k][q], s * A[k][p] + c * A[k][q]];
        for (let k = 0; k < n; k++) [A[p][k], A[q][k]] = [c * A[p][k] - s * A[q][k], s * A[p][k] + c * A[q][k]];
        for (let k = 0; k < n; k++) [V[k][p], V[k][q]] = [c * V[k][p] - s * V[k][q], s * V[k][p] + c * V[k][q]];
      }
    }
  }
  const found = A.map((row, i) => ({ value: row[i], vector: V.map((each) => each[i]) }));
  return found.sort((a, b) => b.value - a.value);
}

/* The inverse of a symmetric matrix with positive eigenvalues; null for others. */
function inverse(matrix) {
  const found = eigen(matrix);
  const least = found[found.length - 1].value;
  if (!(least > 1e-9 * found[0].value)) return null;
  return matrix.map((_, i) =>
    matrix.map((_, j) => found.reduce((sum, { value, vector }) => sum + (vector[i] * vector[j]) / value, 0)));
}
