"""What is known about the single test cases: which tests of ours stand in where a replay cannot show anything."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

STAND_INS: Final[Mapping[int, int]] = {
    0x62000108: 0x60600008,
    0x60000108: 0x60610008,
    0x64110110: 0x60710010,
    0x64010110: 0x60410010,
    0x21100120: 0x60FF0020,
    0x12000120: 0x60640020,
}
"""PDO mapping entry of the device in the trace (CiA 401) -> entry of a drive of the same length and direction."""

_FIRMWARE = "tests/emulator/firmware/"
_SDO = _FIRMWARE + "test_sdo_transfers.py"
_REMOTE = _FIRMWARE + "test_remote_frames.py"
_SYNC = _FIRMWARE + "test_sync.py"
_GUARDING = _FIRMWARE + "test_guarding.py"
_HEARTBEAT = _FIRMWARE + "test_nmt_and_heartbeat.py"
_OBJECTS = _FIRMWARE + "test_every_object.py"
_PDO = _FIRMWARE + "test_pdo_mapping.py"
_EMERGENCIES = _FIRMWARE + "test_emergencies.py"
_STORAGE = _FIRMWARE + "test_stored_parameters.py"
_EDS = "tests/hil/descriptions/test_device_descriptions.py"

OWN_TESTS: Final[Mapping[str, str]] = {
    "1.0": _EDS + "::test_other_readers_load_the_eds",
    "2.11": _OBJECTS + "::test_values_out_of_range_are_refused",
    "2.14": _SDO + "::test_guard_time_is_written_in_every_kind_of_transfer",
    "2.20": _SDO + "::test_guard_time_is_written_in_every_kind_of_transfer",
    "2.24": _SDO + "::test_guard_time_is_written_in_every_kind_of_transfer",
    "3.3": _REMOTE + "::test_a_remote_frame_is_answered_in_operational_only",
    "3.7": _PDO + "::test_transmission_type_0_sends_at_the_sync_after_an_event",
    "3.8": _SYNC + "::test_a_tpdo_begins_with_its_sync_start_value",
    "3.9": _REMOTE + "::test_a_remote_frame_is_answered_in_operational_only",
    "3.14": _SYNC + "::test_a_tpdo_begins_with_its_sync_start_value",
    "3.15": _REMOTE + "::test_a_remote_frame_is_answered_in_operational_only",
    "3.20": _SYNC + "::test_a_tpdo_begins_with_its_sync_start_value",
    "3.22": _PDO + "::test_a_remapped_tpdo_carries_the_new_objects",
    "4.2": _OBJECTS + "::test_after_a_reset_objects_have_their_defaults",
    "4.6": _OBJECTS + "::test_values_out_of_range_are_refused",
    "4.7": _OBJECTS + "::test_reading_gives_the_length_of_the_data_type",
    "4.8": _OBJECTS + "::test_after_a_reset_objects_have_their_defaults",
    "4.9": _OBJECTS + "::test_what_was_read_can_be_written_back",
    "5.6": _EMERGENCIES + "::test_the_history_has_what_the_message_said",
    "7.1": _GUARDING + "::test_every_remote_frame_is_answered_with_the_state_and_a_toggle_bit",
    "7.2": _GUARDING + "::test_every_remote_frame_is_answered_with_the_state_and_a_toggle_bit",
    "7.3": _GUARDING + "::test_the_toggle_bit_starts_anew_after_a_reset",
    "7.4": _GUARDING + "::test_life_guarding_notices_a_master_that_stops_asking",
    "7.5": _GUARDING + "::test_life_guarding_notices_a_master_that_stops_asking",
    "7.6": _GUARDING + "::test_life_guarding_is_over_when_the_master_asks_again",
    "7.105": _HEARTBEAT + "::test_a_heartbeat_faster_than_the_consumer_time_is_enough",
    "7.106": _HEARTBEAT + "::test_a_heartbeat_slower_than_the_consumer_time_is_lost_and_found",
    "7.107": _HEARTBEAT + "::test_a_watched_node_that_resets_is_watched_on",
    "7.202": _GUARDING + "::test_a_node_with_a_heartbeat_is_not_guarded",
    "7.203": _GUARDING + "::test_every_remote_frame_is_answered_with_the_state_and_a_toggle_bit",
    "7.204": _GUARDING + "::test_a_node_with_a_heartbeat_is_not_guarded",
    "7.205": _GUARDING + "::test_a_node_with_a_heartbeat_is_not_guarded",
    "7.206": _GUARDING + "::test_a_node_with_a_heartbeat_is_not_guarded",
    "7.207": _GUARDING + "::test_a_node_with_a_heartbeat_is_not_guarded",
    "8.1": _STORAGE + "::test_a_wrong_signature_is_refused",
    "8.2": _STORAGE + "::test_what_was_saved_is_there_after_a_reset",
}
"""Case -> the test that shows the same, where a replay cannot: the tool skipped the case for the device of the trace,
or failed it, or the trace lacks what counts (7.105 to 7.107 depend on the instants of the tool's heartbeats)."""

NOT_APPLICABLE: Final[Mapping[str, str]] = {
    "2.4": "no object is write-only",
    "2.29": "one SDO server, as its 1200h says",
    "2.30": "no SDO client",
    "4.4": "no object is write-only",
    "8.9": "no object 1020h",
}
"""Case -> why it says nothing about these nodes."""
