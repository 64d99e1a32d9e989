# SPDX-License-Identifier: GPL-3.0-or-later
"""Translations of the user interface. English is the source; German proves that the rest can be added here."""

from typing import Dict, Mapping, Tuple

import bpy

_GERMAN_OPERATORS: Mapping[str, str] = {
    "Make It Flow": "Fließen lassen",
    "Bake": "Backen",
    "Cancel Bake": "Backen abbrechen",
    "Free Bake": "Gebackenes verwerfen",
    "Remove Old Bakes": "Alte Ergebnisse löschen",
    "Export Curlew Scene": "Curlew-Szene exportieren",
    "Import Curlew Scene": "Curlew-Szene importieren",
    "Make Group": "Gruppe erstellen",
}
_GERMAN: Mapping[str, str] = {
    "Contained Swirl": "Wirbel im Objekt",
    "Wind Around the Object": "Wind um das Objekt",
    "Streamlines Around the Object": "Stromlinien um das Objekt",
    "Dust From the Surface": "Staub von der Oberfläche",
    "Flow on the Skin": "Strömung auf der Haut",
    "Globe": "Globus",
    "Smoke Around the Object": "Rauch um das Objekt",
    "Shot to Edit": "Aufnahme zum Bearbeiten",
    "Surface Emitter": "Emitter: Oberfläche",
    "Inside Emitter": "Emitter: Inneres",
    "Collider": "Hindernis",
    "Turbulence": "Turbulenz",
    "Arrow": "Pfeil",
    "Value": "Wert",
    "Sequence": "Sequenz",
    "Substeps": "Teilschritte",
    "Run-Up": "Vorlauf",
    "Repeat": "Wiederholen",
    "Preview": "Vorschau",
    "Bake on Frame Change": "Bei Bildwechsel backen",
    "Keep Frames": "Bilder behalten",
    "Save the file to keep bakes": "Datei speichern, damit Gebackenes bleibt",
    "Updated: restart Blender": "Aktualisiert: Blender neu starten",
    "No Active Object": "Kein aktives Objekt",
    "No Object Needed": "Kein Objekt nötig",
    "Older than its settings: bake again": "Älter als seine Einstellungen: neu backen",
    "The result is older than its settings": "Das Ergebnis ist älter als seine Einstellungen",
    "Results are older than their settings": "Ergebnisse sind älter als ihre Einstellungen",
    "All Options": "Alle Optionen",
    "Fewer Options": "Weniger Optionen",
    "In Each Frame": "In jedem Bild",
    "Mesh Object": "Netz-Objekt",
    "Curve Object": "Kurven-Objekt",
    "Volume Object": "Volumen-Objekt",
    "Particles Result": "Ergebnis: Partikel",
    "Volume Result": "Ergebnis: Volumen",
    "Curves Result": "Ergebnis: Kurven",
    "Mesh Result": "Ergebnis: Netz",
    "Look": "Aussehen",
    "Streaks": "Striche",
    "Resolution": "Auflösung",
    "Wall Thickness": "Dicke der Wand",
    "Voxel Size": "Voxelgröße",
    "Lifetime": "Lebensdauer",
    "Points per Second": "Punkte pro Sekunde",
    "Location": "Position",
    "Rotation": "Drehung",
    "Roughness": "Rauheit",
    "Evolution": "Entwicklung",
    "Loop Length": "Dauer der Schleife",
}


def _dictionary() -> Dict[str, Dict[Tuple[str, str], str]]:
    german = {("*", text): translated for text, translated in _GERMAN.items()}
    german.update({("Operator", text): translated for text, translated in _GERMAN_OPERATORS.items()})
    return {name: german for name in ("de_DE", "de")}  # until 4.4, and later


def register() -> None:
    """Adds the translations to Blender's."""
    bpy.app.translations.register(__package__, _dictionary())


def unregister() -> None:
    """Removes them."""
    bpy.app.translations.unregister(__package__)
