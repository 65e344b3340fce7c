import "avatar-export-player/element";
import sample from "avatar-export-player/sample.avatar?url";
import { useRef } from "react";
import { createRoot } from "react-dom/client";

function App() {
  const avatar = useRef(null);
  return (
    <>
      <gaussian-avatar ref={avatar} src={sample} style={{ display: "block", height: 560 }} camera-controls="" />
      <label>
        Jaw <input type="range" min="0" max="1" step="any" defaultValue="0" onChange={(event) => avatar.current.setExpression("jawOpen", Number(event.target.value))} />
      </label>
    </>
  );
}

createRoot(document.getElementById("root")).render(<App />);
