//! What is to be noted of a recording that is about to be used.

use crate::training::LoadedRecording;

/// What had to be fitted when it was read, and what it lacks; each line begins with its folder.
pub fn of(loaded: &LoadedRecording) -> Vec<String> {
    let mut notes = loaded.recording.notes.clone();
    if loaded.recording.person().is_none() {
        notes.push("no person: only the room is simulated".into());
    }
    if loaded.recording.room.is_none() {
        notes.push("no room: only the person is simulated, without indirect path".into());
    }
    notes.into_iter().map(|note| format!("{}: {note}", loaded.folder.display())).collect()
}
