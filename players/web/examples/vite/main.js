import "avatar-export-player/element";
import sample from "avatar-export-player/sample.avatar?url";

const avatar = document.querySelector("gaussian-avatar");
avatar.src = sample;
avatar.addEventListener("load", () => avatar.setExpression("mouthSmileLeft", 1));
