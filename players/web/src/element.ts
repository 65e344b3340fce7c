// `<gaussian-avatar>`: importing this module registers the element.
import { GaussianAvatarElement } from "./element/avatar_element.js";

export { GaussianAvatarElement };

const NAME = "gaussian-avatar";

declare global {
  interface HTMLElementTagNameMap {
    "gaussian-avatar": GaussianAvatarElement;
  }
}

if (typeof customElements !== "undefined" && customElements.get(NAME) === undefined) customElements.define(NAME, GaussianAvatarElement);
