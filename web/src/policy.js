// The shipped policy.onnx by ONNX Runtime, on one thread: no worker, no request, so that it runs from file://.
import * as ort from "onnxruntime-web/wasm";

/** @typedef {(observation: number[], memory: Float32Array) =>
 *   Promise<{action: number[], memory: Float32Array}>} Act */

/** @type {(text: string) => Uint8Array<ArrayBuffer>} */
function bytesOf(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** Load the policy.
 * @param {string} runtime base64 of the gzipped WebAssembly of ONNX Runtime
 * @param {string} policy base64 of policy.onnx
 * @param {number} memorySize numbers that it hands from one question to the next
 * @returns {Promise<Act>} */
export async function loadPolicy(runtime, policy, memorySize) {
  const packed = new Blob([bytesOf(runtime)]).stream();
  const binary = await new Response(packed.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  ort.env.wasm.wasmBinary = binary;
  ort.env.wasm.numThreads = 1;
  ort.env.wasm.proxy = false;
  const session = await ort.InferenceSession.create(bytesOf(policy), { executionProviders: ["wasm"] });
  return async (observation, memory) => {
    /** @type {Record<string, ort.Tensor>} */
    const fed = { observation: new ort.Tensor("float32", Float32Array.from(observation), [1, observation.length]) };
    if (memorySize) fed.memory = new ort.Tensor("float32", memory, [1, memorySize]);
    const found = await session.run(fed);
    const action = Array.from(/** @type {Float32Array} */ (found.action.data), (x) => Math.min(Math.max(x, -1), 1));
    const next = memorySize ? Float32Array.from(/** @type {Float32Array} */ (found.next_memory.data)) : memory;
    return { action, memory: next };
  };
}
