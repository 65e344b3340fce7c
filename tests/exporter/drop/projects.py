"""Projects with the files that each engine creates, as small as they can be."""

from __future__ import annotations

UNITY = {
    "Assets/Scenes.meta": "fileFormatVersion: 2\nguid: 131a6b21c8605f84396be9f6751fb6e3\nfolderAsset: yes\n",
    "Assets/Scenes/SampleScene.unity": "%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n",
    "Assets/Scenes/SampleScene.unity.meta": "fileFormatVersion: 2\nguid: 9fc0d4010bbf28b4594072e72b8655ab\n",
    "Packages/manifest.json": '{\n  "dependencies": {\n    "com.unity.ugui": "1.0.0"\n  }\n}\n',
    "Packages/packages-lock.json": '{\n  "dependencies": {}\n}\n',
    "ProjectSettings/ProjectSettings.asset": "%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n",
    "ProjectSettings/ProjectVersion.txt": "m_EditorVersion: 2022.3.20f1\n"
    "m_EditorVersionWithRevision: 2022.3.20f1 (61c2feb0970d)\n",
    "Library/ArtifactDB": "made by Unity",
}
UNREAL = {
    "Game.uproject": '{\n\t"FileVersion": 3,\n\t"EngineAssociation": "5.4",\n\t"Category": "",\n\t"Description": "",\n'
    '\t"Modules": [\n\t\t{\n\t\t\t"Name": "Game",\n\t\t\t"Type": "Runtime",\n\t\t\t"LoadingPhase": "Default"\n'
    "\t\t}\n\t]\n}\n",
    "Config/DefaultEngine.ini": "[/Script/EngineSettings.GameMapsSettings]\n",
    "Content/Collections/.keep": "",
    "Source/Game.Target.cs": "public class GameTarget : TargetRules {}\n",
    "Source/GameEditor.Target.cs": "public class GameEditorTarget : TargetRules {}\n",
    "Source/Game/Game.Build.cs": "public class Game : ModuleRules {}\n",
}
GODOT = {
    "project.godot": "; Engine configuration file.\n\nconfig_version=5\n\n[application]\n\n"
    'config/name="Game"\nconfig/features=PackedStringArray("4.6", "Forward Plus")\nconfig/icon="res://icon.svg"\n',
    "icon.svg": '<svg xmlns="http://www.w3.org/2000/svg"/>\n',
    "icon.svg.import": '[remap]\n\nimporter="texture"\n',
}
NPM = {
    "package.json": '{\n  "name": "shop",\n  "private": true,\n  "version": "1.2.3",\n  "type": "module",\n'
    '  "dependencies": {\n    "three": "^0.187.0"\n  },\n  "devDependencies": {\n    "vite": "^7.1.0"\n  }\n}\n',
    "index.html": '<!doctype html>\n<script type="module" src="/src/main.js"></script>\n',
    "public/vite.svg": '<svg xmlns="http://www.w3.org/2000/svg"/>\n',
    "src/main.js": "document.title = 'shop'\n",
}
WEB = {"index.html": "<!doctype html>\n<title>Mine</title>\n", "style.css": "body { margin: 0 }\n"}
