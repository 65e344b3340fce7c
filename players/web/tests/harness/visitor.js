// A page that follows a visitor, and says what hinders it.
import { Visitor } from "../../src/visitor.js";

window.seen = [];
window.begin = async (options) => {
  try {
    window.visitor = await Visitor.start({ files: "talk/", onFrame: ({ seen, frame }) => window.seen.push([seen, Math.max(...frame.weights)]), ...options });
    return "";
  } catch (error) {
    return `${error.name}: ${error.message}`;
  }
};
