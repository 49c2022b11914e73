"""Recordings of passes: read in any order, from several stations, counted by what was left out.

`torquer.ground.recording` puts them into archives with these parts:

dialects    files that are no plain bytes: read, or named: other orders, other frames, CCSDS
hexadecimal text in hexadecimal, dumps with offsets
kiss        frames in KISS and AX.25, cut ends included
authentic   protected frames by their MAC, each once, whatever their counters
joined      packets that lie across frames, by the counters of these
plain       frames without protection, many at a time
counters    space packets that are missing, by their counters
batches     rows for the archive, many at a time
left_out    what was left out, by reason
"""
