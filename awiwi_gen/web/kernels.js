/* The generated C as functions: kernels.index_gravity(q, g) gives {gravity: numbers}. */
"use strict";

async function loadKernels(base64, signatures) {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const { exports } = (await WebAssembly.instantiate(bytes)).instance;
  let end = Math.ceil(exports.__heap_base.value / 8) * 8;
  const reserve = ([name, count]) => {
    const array = { name, count, address: end };
    end += 8 * count;
    return array;
  };
  const kernels = {};
  for (const [name, signature] of Object.entries(signatures)) {
    const inputs = signature.inputs.map(reserve);
    const outputs = signature.outputs.map(reserve);
    const addresses = [...inputs, ...outputs].map((array) => array.address);
    const numbers = (array) => new Float64Array(exports.memory.buffer, array.address, array.count);
    kernels[name] = (...given) => {
      inputs.forEach((array, index) => numbers(array).set(given[index]));
      exports[signature.function](...addresses);
      return Object.fromEntries(outputs.map((array) => [array.name, Array.from(numbers(array))]));
    };
  }
  const missing = end - exports.memory.buffer.byteLength;
  if (missing > 0) exports.memory.grow(Math.ceil(missing / 65536));
  return kernels;
}
