"""Inputs of a campaign are told as a reader says them, with their units."""

from torquer.base.language import told
from torquer.report.campaign.shared import fit_label, input_labels


def test_inputs_are_told_in_words_with_units():
    assert input_labels(
        [
            "control.law.gain_a_m2_s_per_t",
            "control.law.parameters.gain",
            "initial.rate_deg_s[2]",
            "|initial.rate_deg_s|",
            "initial.rate_deg_s.direction[0]",
            "initial.attitude[0][1]",
            "spacecraft.body.inertia_kg_m2, spacecraft.coils.limit_a_m2",
            "start",
        ]
    ) == {
        "control.law.gain_a_m2_s_per_t": "law gain [A m² s/T]",
        "control.law.parameters.gain": "law gain",
        "initial.rate_deg_s[2]": "initial rate, component 2 [deg/s]",
        "|initial.rate_deg_s|": "size of initial rate [deg/s]",
        "initial.rate_deg_s.direction[0]": "direction of initial rate, component 0",
        "initial.attitude[0][1]": "initial attitude, component 0, 1",
        "spacecraft.body.inertia_kg_m2, spacecraft.coils.limit_a_m2": "body inertia [kg m²], "
        "coils limit [A m²]",
        "start": "start",
    }


def test_two_inputs_that_would_read_the_same_keep_their_keys():
    keys = ["control.laws.hold.gain_a_m2_s_per_t", "control.modes.hold.gain_a_m2_s_per_t"]
    assert input_labels(keys) == {key: key for key in keys}


def test_a_label_is_shortened_in_the_language_in_which_it_is_read(monkeypatch):
    label = input_labels(["initial.rate_deg_s.direction[1]"])["initial.rate_deg_s.direction[1]"]
    assert fit_label(label, 34, 2) == "direction of initial rate,\ncomponent 1"
    assert fit_label(label, 20) == "…l rate, component 1"
    monkeypatch.setenv("TORQUER_LANG", "ru")
    assert fit_label(label, 60) == told(label) != label
    assert fit_label(label, 20) == "…" + told(label)[-19:]
