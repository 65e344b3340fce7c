export { conform, type ConformReport, type ConformRow, type ReferenceFiles } from "./conform/conform.js";
export type { Verdict } from "./conform/judge.js";
