declare module "inline-worker:*" {
  /** The worker as one script. */
  const text: string;
  export default text;
}
