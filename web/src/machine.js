// Runs the programs that Python makes of the policy and of the environment's own step (viewing/web/machine.py).

/** @typedef {object} Program As exported.
 * @property {string} constants base64 of float64, the first numbers of the memory
 * @property {Record<string, [number, number]>} inputs first cell and count of the numbers of each input
 * @property {Record<string, number[]>} outputs cells of the numbers of each output
 * @property {{columns: number, numbers: string}[]} tables matrices, row by row, base64 of float32
 * @property {number} size count of cells
 * @property {any[][]} rows instructions: operation, and a list for each operand; their results go to one cell after the
 *   other, behind the inputs */
/** @typedef {Record<string, ArrayLike<number>>} Numbers */
/** @typedef {(given: Numbers) => Record<string, number[]>} Run Outputs by name for inputs by name. */

const OF_MATH = [
  "abs", "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "ceil", "cos", "cosh", "exp", "expm1",
  "floor", "log", "log1p", "max", "min", "pow", "sign", "sin", "sinh", "sqrt", "tan", "tanh", "trunc",
];
/** Instructions that work number by number. @type {Record<string, (...x: any[]) => number>} */
export const ELEMENTWISE = {
  .../** @type {any} */ (Object.fromEntries(OF_MATH.map((name) => [name, /** @type {any} */ (Math)[name]]))),
  neg: (a) => -a,
  not: (a) => +!a,
  // halves to the even neighbour
  round: (a) => (Math.abs(a % 1) === 0.5 ? 2 * Math.round(a / 2) : Math.round(a)),
  add: (a, b) => a + b,
  sub: (a, b) => a - b,
  mul: (a, b) => a * b,
  div: (a, b) => a / b,
  rem: (a, b) => a % b,
  eq: (a, b) => +(a === b),
  ne: (a, b) => +(a !== b),
  lt: (a, b) => +(a < b),
  le: (a, b) => +(a <= b),
  gt: (a, b) => +(a > b),
  ge: (a, b) => +(a >= b),
  and: (a, b) => a & b,
  or: (a, b) => a | b,
  xor: (a, b) => a ^ b,
  select: (condition, no, yes) => (condition ? yes : no),
};

/** The bytes of base64. @type {(text: string) => ArrayBuffer} */
export const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;

/** Prepare a program. @type {(program: Program) => Run} */
export function machine({ constants, inputs, outputs, tables, size, rows }) {
  const memory = new Float64Array(size);
  const known = new Float64Array(bytesOf(constants));
  memory.set(known);
  const matrices = tables.map((table) => ({ columns: table.columns, numbers: new Float32Array(bytesOf(table.numbers)) }));
  let next = known.length + Object.values(inputs).reduce((sum, [, count]) => sum + count, 0);
  const steps = rows.map((row) => {
    const first = next;
    next += row[row.length - 1].length;
    return stepOf(memory, matrices, first, row);
  });
  return (given) => {
    for (const [name, [at, count]] of Object.entries(inputs)) {
      if (given[name]?.length !== count) throw new Error(`${name} has ${given[name]?.length} numbers, not ${count}`);
      memory.set(given[name], at);
    }
    for (const step of steps) step();
    return Object.fromEntries(Object.entries(outputs).map(([name, cells]) => [name, cells.map((i) => memory[i])]));
  };
}

/** What computes a row. @type {(memory: Float64Array, matrices: any[], first: number, row: any[]) => () => void} */
function stepOf(memory, matrices, first, [operation, ...operands]) {
  if (operation === "dot") {
    const [vector, table, chosen] = operands;
    const { columns, numbers } = matrices[table];
    return () => {
      for (let j = 0; j < chosen.length; j++) {
        let sum = 0;
        for (let i = 0; i < vector.length; i++) sum += memory[vector[i]] * numbers[i * columns + chosen[j]];
        memory[first + j] = sum;
      }
    };
  }
  if (operation === "lookup") {
    const [index, entries] = operands;
    return () => {
      for (let i = 0; i < index.length; i++) {
        const last = entries[i].length - 1;
        memory[first + i] = memory[entries[i][Math.min(Math.max(memory[index[i]], 0), last)]];
      }
    };
  }
  const work = ELEMENTWISE[operation];
  if (!work) throw new Error(`the page has no instruction ${operation}: its page.js is older than its flight.js`);
  const [a, b, c] = operands.map((cells) => Int32Array.from(cells));
  if (c) return () => { for (let i = 0; i < a.length; i++) memory[first + i] = work(memory[a[i]], memory[b[i]], memory[c[i]]); };
  if (b) return () => { for (let i = 0; i < a.length; i++) memory[first + i] = work(memory[a[i]], memory[b[i]]); };
  return () => { for (let i = 0; i < a.length; i++) memory[first + i] = work(memory[a[i]]); };
}
