"""`python3 scripts/independent/cases.py OUT [PREFIX ...]` writes OUT/cases/NAME and OUT/truth/NAME.json of all cases, or of those named so.

n_: no imperfection of the radar; p_: one. A truth has the effects with what is as good an answer (`accept`), the movers, and `true_ids`: all
ids that may be stated of the recording. Any other id stated with confidence is wrong.
"""
import sys, os, json, time
import numpy as np
from generator import *

CASES = []


def case(name, *a, **k):
    CASES.append((name, a, k))


TAU = 2 * np.pi
X = lambda p: (lambda t: p + 0 * t[..., None])
ROOM = dict(left_m=1.9, right_m=2.4, front_m=5.6, back_m=0.6, floor_m=1.0, ceiling_m=1.7)
ROOM2 = dict(left_m=2.6, right_m=1.6, front_m=6.8, floor_m=1.1)


def W(seed, p0, p1, v=1.0, **k):
    return walker(seed, line(p0, p1, v), v, **k)


def sway(seed, amp, freqs, vert=0.4):
    """handheld: a sum of tones on x, y, z; amp metres (peak of the boresight motion about)"""
    r = np.random.default_rng([seed, 31]); w = r.uniform(0, TAU, (3, len(freqs))); g = np.array([1, .6, .35, .2])[:len(freqs)]; g = g / g.sum()

    def d(t):
        return np.stack([amp * a * sum(g[i] * np.sin(TAU * f * t + w[j, i]) for i, f in enumerate(freqs)) for j, a in enumerate((.6, 1.0, vert))], -1)
    return d


def vib(amp, f, axis=(0, 1, 0), ph=0.4):
    a = np.array(axis, float); a /= np.linalg.norm(a)
    return lambda t: amp * np.sin(TAU * f * t + ph)[..., None] * a


def S_(seed, n, R, near=.8, **k):
    return statics(seed, n, min(R.rmax * .85, 9.0), near, **k)


def inside(seed, n, room):
    """still things within the room"""
    q = [s for s in statics(seed, 400, room['front_m'], .8) if -room['left_m'] + .1 < s[0][0] < room['right_m'] - .1 and s[0][1] < room['front_m'] - .1]
    return q[:n]


def N(name, R, seed, **k):
    case('n_' + name, R, seed, k)


def P(name, R, seed, **k):
    case('p_' + name, R, seed, k)


def E(id, accept=(), **k):
    return dict({'name': k.pop('name', id), 'id': k.pop('word', id), 'accept': [id if id else None] + list(accept), 'minor': False}, **k)


NOHW = ['radar_vibration', 'phase_noise', 'interference', 'spur', 'iq_imbalance', 'second_harmonic', 'compression', 'chirp_ripple', 'chirp_start_jitter',
        'gain_drift', 'impulsive_noise', 'frame_drop', 'channel_mismatch', 'adc_saturation', 'chirp_settling', 'if_highpass', 'chirp_nonlinearity']

# ============================================================================================= n: nothing wrong
R = ti(loops=32, frames=12); N('static_1tx', R, 101, statics=S_(101, 30, R), leak=(8, .08), notes='still room')
R = ti(loops=16, frames=16, ntx=2, tc=80e-6, tf=0.05, slope=60e12, fs=4.4e6, f0=77e9); N('static_room_2tx', R, 102, statics=inside(102, 20, ROOM) + room_statics(ROOM, 102), room=ROOM, leak=(5, .06), notes='still room, its walls given')
R = ifx(); N('static_ifx', R, 103, statics=S_(103, 25, R), leak=(12, .10), notes='still room, real sampling')
R = ti(loops=64, frames=12, tc=150e-6); N('walker_1tx', R, 104, statics=S_(104, 30, R), leak=(8, .08), movers=[W(104, (.4, 2.0, 0), (-.3, 5.0, 0), 1.1)], notes='one walker, receding')
R = ti(loops=24, frames=16, ntx=3, tc=70e-6, tf=0.1, slope=60e12, fs=4.4e6); N('walker_3tx_room', R, 105, statics=inside(105, 20, ROOM) + room_statics(ROOM, 105), room=ROOM, leak=(5, .06), movers=[W(105, (.7, 4.4, 0), (-.6, 1.4, 0), .9)], notes='one walker, room given, no wall images')
R = ifx(loops=48, frames=48); N('walker_ifx', R, 106, statics=S_(106, 25, R), leak=(12, .1), movers=[W(106, (-.5, 1.2, 0), (.8, 4.5, 0), .8)], notes='one walker, real sampling, tx=rx reference')
R = ti(loops=64, frames=10, tc=150e-6); N('two_walkers_1tx', R, 107, statics=S_(107, 30, R), leak=(8, .08), movers=[W(107, (.9, 1.6, 0), (.7, 2.9, 0), 1.0), W(1107, (-1.4, 6.5, 0), (-.8, 4.2, 0), 1.3)], notes='two walkers')
R = ti(loops=32, frames=12, ntx=2, tc=100e-6, tf=.08); N('two_walkers_2tx', R, 108, statics=S_(108, 40, R), leak=(6, .08), movers=[W(108, (0, 3.0, 0), (.2, 1.5, 0), .7), W(1108, (1.6, 5.0, 0), (-1.6, 5.1, 0), 1.2)], notes='two walkers, one across the line of sight')
R = ti(loops=8, frames=60, n=160, slope=60e12, fs=4.4e6, tc=300e-6, tf=.066); N('cross_cells_long', R, 109, statics=S_(109, 30, R), leak=(5, .07), movers=[W(109, (.3, 1.2, 0), (-.2, 6.6, 0), 1.35)], notes='walker over about 75 range cells in 4 s')
R = ti(loops=32, frames=14, n=256, slope=80e12, fs=5e6, tc=100e-6, tf=.1, nrx=3); N('cross_cells_wide', R, 110, statics=S_(110, 30, R), leak=(5, .07), movers=[W(110, (-.8, 6.2, 0), (.5, 1.0, 0), 2.4, rcs=-7)], notes='a runner over about 80 cells of 3.7 cm')
R = ti(loops=1, frames=400, n=100, slope=60e12, tc=60e-6, tf=.05); N('breath_1chirp', R, 111, statics=S_(111, 30, R), leak=(10, .09), movers=[breather(111, (.1, .9, -.2), .27, .005)], notes='seated person, 20 frames/s, one chirp each')
R = ifx(loops=8, frames=200, n=64, slope=60e12, tc=400e-6, tf=.07); N('breath_ifx', R, 112, statics=statics(112, 15, 2.2, .5), leak=(14, .06), movers=[breather(112, (-.1, .6, 0), .31, .004, rcs=-12)], notes='seated person, real sampling')
R = ti(loops=4, frames=240, n=96, slope=50e12, tc=80e-6, tf=.05); N('two_breathers', R, 113, statics=S_(113, 25, R), leak=(8, .09), movers=[breather(113, (-.4, 1.1, 0), .22, .004), breather(1113, (.9, 2.3, 0), .33, .006)], notes='two seated people')
R = ti(loops=96, frames=8, n=96, tc=160e-6, tf=.1); N('fan_walker', R, 114, statics=S_(114, 30, R), leak=(8, .08), movers=[fan(114, (-1.0, 2.2, .2), 9.3), W(114, (.8, 3.2, 0), (.4, 5.8, 0), 1.0)], notes='fan of three blades and a walker')
R = ti(loops=100, frames=10, n=80, tc=1e-3, tf=.1); N('fan_gapless', R, 115, statics=S_(115, 25, R), leak=(8, .08), movers=[fan(115, (.3, 1.6, 0), 14.1, blades=4, radius=.12)], notes='fan, one chirp a millisecond without gaps: its Doppler is aliased')
R = ti(loops=16, frames=40, n=96, tc=150e-6, tf=.05); N('handheld_small', R, 116, statics=S_(116, 22, R), leak=(6, .08), platform=sway(116, .003, (.7, 1.6)), present=['radar_vibration'], notes='radar held in the hand, 3 mm at 0.7 and 1.6 Hz; leakage does not move. A statement that the radar moves is true; its swing projected on each line of sight')
R = ti(loops=1, frames=300, n=96, slope=45e12, tc=60e-6, tf=.02); N('handheld_walker_1chirp', R, 117, statics=S_(117, 22, R), leak=(6, .08), platform=sway(117, .012, (.4, 1.1, 1.9)), movers=[W(117, (.5, 2.0, 0), (.2, 5.0, 0), .8)], present=['radar_vibration'], notes='handheld, about 1 cm, and a walker')
R = ti(loops=96, frames=5, n=96, tc=120e-6, tf=.05, nrx=4); N('vehicle_3mps', R, 118, statics=S_(118, 24, R, 2.0, rcs=(-18, 2)), leak=(6, .08), platform=lambda t: np.stack([.0 * t, 3.0 * t, 0 * t], -1), also=['moving_reflector'], notes='radar moves ahead at 3 m/s: every still thing approaches with cos(angle)')
R = ti(loops=12, frames=50, n=96, tc=200e-6, tf=.04, nrx=3); N('vehicle_slow', R, 119, statics=S_(119, 24, R, 2.0, rcs=(-18, 2)), leak=(6, .08), platform=lambda t: np.stack([.15 * t, .4 * t, 0 * t], -1), also=['moving_reflector'], notes='cart at 0.43 m/s, obliquely')
R = ti(loops=32, frames=12, ntx=3, tc=300e-6, tf=.1, slope=40e12); N('fast_alias_3tx', R, 120, statics=S_(120, 25, R), leak=(6, .08), movers=[W(120, (-.8, 7, 0), (.3, 1.5, 0), 3.1, rcs=-7)], notes='runner at 3.1 m/s, unambiguous only to 1.06 m/s')
R = ifx(loops=32, frames=30, tc=1.2e-3, tf=.05); N('fast_alias_ifx', R, 121, statics=S_(121, 25, R), leak=(12, .1), movers=[W(121, (.6, 6.5, 0), (0, 1.6, 0), 2.2)], notes='2.2 m/s at unambiguous 1.03 m/s, real sampling')
R = ifx(loops=32, frames=24, k_db=38, rail=2047, write_rail=True); N('strong_leak_ifx', R, 122, statics=S_(122, 25, R), leak=(45, .05), movers=[W(122, (.4, 1.5, 0), (.6, 4, 0), .9)], present=['tx_leakage'], notes='leakage of 500 codes on 12 bits, not clipped')
R = ti(loops=64, frames=4, tc=120e-6); N('few_frames_walker', R, 123, statics=S_(123, 30, R), leak=(8, .08), movers=[W(123, (.2, 2.6, 0), (.1, 5, 0), 1.2)], notes='four frames')
R = ti(loops=24, frames=6, ntx=2, tc=120e-6); N('few_frames_static', R, 124, statics=S_(124, 50, R), leak=(8, .08), notes='six frames, still')
R = ti(loops=128, frames=1, n=256, slope=30e12, tc=150e-6, tf=.1); N('one_frame_walker', R, 125, statics=S_(125, 30, R), leak=(8, .08), movers=[W(125, (.5, 3.0, 0), (.1, 5, 0), 1.2)], notes='a single frame of 128 chirps')
R = ti(loops=128, frames=1, n=128, ntx=3, tc=120e-6, tf=.1); N('one_frame_static', R, 126, statics=S_(126, 40, R), leak=(8, .08), notes='a single frame, still, 3 tx')
R = ti(loops=1, frames=400, n=96, slope=70e12, fs=4e6, tc=60e-6, tf=.01, nrx=3)
hand = lambda t: np.stack([.05 * np.sin(TAU * .9 * t), .45 + .08 * np.sin(TAU * 1.3 * t + 1) + .01 * np.sin(TAU * 4 * t), .03 * np.cos(TAU * .9 * t)], -1)
N('gesture_100hz', R, 127, statics=statics(127, 20, 6.0, 1.0), leak=(12, .07), movers=[parts_at(hand, -24, 'unknown', what='hand', rate_hz=1.3, swing_m=.16)], notes='a hand moves at 0.45 m, 100 chirps/s')
R = ti(loops=1, frames=300, n=128, slope=40e12, tc=60e-6, tf=.05); N('walker_20hz', R, 128, statics=S_(128, 30, R), leak=(8, .08), movers=[W(128, (-.6, 1.6, 0), (.6, 5.6, 0), .9)], notes='walker at 20 chirps/s: Doppler aliases 60-fold')
R = ti(loops=32, frames=16, tc=150e-6, tf=.08); N('red_pn_walker', R, 129, statics=S_(129, 30, R, rcs=(-20, 2)), leak=(8, .08), movers=[W(129, (.3, 2.0, 0), (.1, 4, 0), .8)], pn=2.0, pn_red=2.5e5, present=['phase_noise', 'coloured_noise'], notes='oscillator whose frequency walks (250 kHz after 1 s), cancelled in part by the delay; noise of an ordinary oscillator')
R = ti(loops=64, frames=8, n=128, slope=30e12, tc=100e-6); N('red_pn_static', R, 130, statics=S_(130, 25, R, rcs=(-12, 8)), leak=(15, .08), pn=4.0, pn_red=1e5, present=['phase_noise', 'coloured_noise'], notes='strong still returns, an oscillator 12 dB noisier than usual')
R = ti(loops=32, frames=12, sigma=.4, rail=2047, write_rail=True); N('quant12', R, 131, statics=S_(131, 30, R), leak=(8, .08), movers=[W(131, (.2, 2.4, 0), (.1, 5, 0), 1.0, rcs=-14)], notes='thermal noise of 0.4 LSB: quantisation is seen')
R = ti(loops=32, frames=20, n=96, slope=60e12, tc=150e-6, tf=.05); N('near_leakage', R, 132, statics=S_(132, 25, R), leak=(25, .07), movers=[parts_at(lambda t: np.stack([.02 + 0 * t, .22 + .015 * np.sin(TAU * 1.7 * t), 0 * t], -1), -34, 'unknown', what='hand near the antenna', rate_hz=1.7, swing_m=.03)], notes='a small thing moves at 0.22 m beside the leakage')
R = ti(loops=16, frames=36, ntx=2, tc=120e-6, tf=.09, slope=50e12); N('door', R, 133, statics=S_(133, 25, R), leak=(8, .08), movers=[door((-.4, 3.6, .1))], notes='a door opens within 2.5 s')
R = ti(loops=32, frames=10, n=96, tc=200e-6, tf=.1, nrx=4); N('vegetation', R, 134, statics=S_(134, 12, R), leak=(8, .08), movers=[vegetation(134, 50, 2.5, 7.5)], notes='50 leaves and twigs in the wind')
R = ti(loops=8, frames=40, n=96, tc=250e-6, tf=.06, nrx=3); N('vegetation_walker', R, 135, statics=S_(135, 12, R), leak=(8, .08), movers=[vegetation(135, 40, 3.5, 8.0), W(135, (.6, 1.5, 0), (-.4, 4.5, 0), 1.1)], notes='wind in bushes behind a walker')
R = ti(loops=32, frames=12); N('noise_only', R, 136, pn=0, notes='thermal noise only')
R = ifx(loops=16, frames=40); N('noise_only_ifx', R, 137, pn=0, notes='thermal noise only, real')
R = ti(loops=32, frames=12, slope=-30e12, f0=80.5e9, tc=150e-6); N('falling_chirp_walker', R, 138, statics=S_(138, 30, R), leak=(8, .08), movers=[W(138, (.2, 2.4, 0), (.1, 5, 0), 1.0)], notes='falling chirps')
def lost(R, r):
    v = np.ones((R.F, R.T, R.R, R.L), bool); v[4, :, :, 10:23] = False; v[9, :, :, :5] = False; return v
R = ti(loops=32, frames=12, ntx=2, tc=120e-6); N('valid_mask', R, 139, statics=S_(139, 30, R), leak=(8, .08), movers=[W(139, (.2, 2.4, 0), (.1, 5, 0), 1.0)], valid=lost, notes='lost chirps are zero-filled and declared so in valid.npy')
R = ifx(loops=32, frames=30, bits_offset=2048, rail=4095); N('offset_binary_ifx', R, 140, statics=S_(140, 25, R), leak=(20, .06), movers=[breather(140, (.1, 1.1, 0), .3, .005)], also=['dc_offset'], notes='12-bit offset-binary codes (middle 2048) in int16, as the chip delivers them; a seated person')
R = ti(loops=16, frames=40, tc=150e-6, tf=.1, slope=40e12)
leave = lambda t: np.stack([.3 + 0 * t, 1.3 + 1.0 * np.clip(t - 2.0, 0, 9) + 0.002 * np.sin(TAU * .3 * t), 0 * t], -1)
N('sits_then_leaves', R, 141, statics=S_(141, 25, R), leak=(8, .08), movers=[walker(141, (leave, np.array([0, 1.0, 0])), 1.0, act=lambda t: .01 + .99 * np.clip((t - 1.9) / .5, 0, 1)), ], notes='a person stands still for 2 s (limbs move by 1 % of a stride), then walks off', also=['breathing'])
R = ti(loops=64, frames=10, n=64, slope=20e12, fs=2.5e6, tc=120e-6, nrx=1); N('single_rx_walker', R, 142, statics=S_(142, 30, R), leak=(8, .08), movers=[W(142, (.2, 3.4, 0), (.1, 6, 0), 1.2)], notes='one receiver: no angles')
R = ti(loops=50, frames=12, n=90, tc=1e-3, tf=.05); N('pendulum_phone', R, 143, statics=S_(143, 25, R), leak=(8, .08), movers=[vibrator((.2, 1.2, 0), 172.0, 3e-5, -12), parts_at(lambda t: np.stack([-.6 + .1 * np.sin(TAU * .8 * t), 2.4 + .15 * np.sin(TAU * .8 * t), 0 * t], -1), -18, 'unknown', what='pendulum', rate_hz=.8, swing_m=.3)], notes='a phone vibrates at 1.2 m, a pendulum swings at 2.4 m; gapless chirps')
R = ti(loops=20, frames=30, ntx=2, tc=100e-6, tf=.07, pos=(.05, -.02, .1)); N('walker_offset_ref', R, 144, statics=S_(144, 25, R), leak=(8, .08), movers=[W(144, (.9, 2.0, 0), (-.9, 2.6, 0), .9)], notes='the antennas\' reference is off the origin')

# ============================================================================================= p: one hardware effect
def step(at, db, deg):
    g = 10 ** (db / 20) * np.exp(1j * np.deg2rad(deg)); return lambda tc, tn: np.where(tc >= at, g, 1.0)
def ripple(db, f, deg=0):
    m = 10 ** (db / 20) - 1; return lambda tc, tn: (1 + m * np.sin(TAU * f * tc + .8)) * np.exp(1j * np.deg2rad(deg) * np.sin(TAU * f * tc + .8))
GD = ('chirp_settling',)
R = ti(loops=32, frames=14, tc=150e-6); P('gain_step_walker', R, 201, statics=S_(201, 30, R), leak=(8, .08), movers=[W(201, (.4, 2.0, 0), (-.3, 5.0, 0), 1.0)], effects={'gain': step(.7, 1.2, 9), 'gain_noise': True}, truth=[E('gain_drift', db=1.2, rad=.157, frame=7)], notes='gain steps by 1.2 dB and 9 deg at frame 7 (receiver: noise too)')
R = ti(loops=1, frames=300, n=96, slope=50e12, tc=60e-6, tf=.05); P('gain_step_1chirp', R, 202, statics=S_(202, 30, R), leak=(8, .08), movers=[breather(202, (.1, 1.2, 0), .25, .004)], effects={'gain': step(6.02, -.8, 0)}, truth=[E('gain_drift', db=-.8, frame=121)], notes='gain falls by 0.8 dB at frame 121 of 300')
R = ti(loops=100, frames=10, n=80, tc=1e-3, tf=.1); P('gain_mains_static', R, 203, statics=S_(203, 30, R), leak=(8, .08), effects={'gain': ripple(.15, 99.7)}, truth=[E('gain_drift', [None], word='gain_ripple', db=.15, rate_hz=99.7, behaves=['slow-time', 'gain'])], notes='gain ripples by 0.15 dB at 99.7 Hz')
R = ti(loops=24, frames=40, tc=150e-6, tf=.1, n=96); P('gain_slow_walker', R, 204, statics=S_(204, 30, R), leak=(8, .08), movers=[W(204, (.4, 2.0, 0), (-.3, 4.0, 0), .7)], effects={'gain': ripple(.4, .4)}, truth=[E('gain_drift', [None], word='gain_ripple', db=.4, rate_hz=.4, behaves=['slow-time', 'gain'])], notes='gain follows a sinusoid of 0.4 dB at 0.4 Hz')
drift = lambda hz, tf: (lambda tc, tn: np.exp(2j * np.pi * hz * np.floor(tc / tf + 1e-9) * tf))
PD = ['phase_noise', 'radar_vibration', 'clock_drift', 'clock_offset', None]
R = ti(loops=16, frames=24, ntx=2, tc=100e-6, tf=.05); P('phase_drift_static', R, 205, statics=S_(205, 30, R), leak=(8, .08), effects={'gain': drift(.6, .05)}, truth=[E('gain_drift', PD, word='phase_drift', rad_per_frame=TAU * .6 * .05, behaves=['slow-time', 'phase', 'drift'])], notes='common phase of all returns, leakage too, turns by 0.19 rad a frame, constant within the frame')
R = ti(loops=1, frames=240, n=100, slope=55e12, tc=60e-6, tf=.05); P('phase_drift_breath', R, 206, statics=S_(206, 25, R), leak=(8, .08), movers=[breather(206, (0, 1.0, 0), .28, .004)], effects={'gain': drift(.015, .05)}, truth=[E('gain_drift', PD, word='phase_drift', rad_per_frame=TAU * .015 * .05, behaves=['slow-time', 'phase', 'drift'])], notes='common phase drifts by 1.1 rad in all (15 mHz)')
R = ti(loops=64, frames=12, tc=150e-6, tf=.05); P('vibration_walker', R, 207, statics=S_(207, 25, R), leak=(8, .08), movers=[W(207, (.4, 2.0, 0), (-.3, 5.0, 0), .9)], effects={'vib': vib(60e-6, 31.0)}, truth=[E('radar_vibration', amplitude_m=60e-6, frequency_hz=31.0)], notes='platform shakes at 31 Hz by 60 um along boresight; leakage does not')
R = ti(loops=16, frames=24, ntx=3, tc=100e-6, tf=.04); P('vibration_static_3tx', R, 208, statics=S_(208, 20, R), leak=(5, .08), effects={'vib': vib(150e-6, 11.3, (.3, 1, .1))}, truth=[E('radar_vibration', amplitude_m=150e-6, frequency_hz=11.3)], notes='platform shakes at 11.3 Hz')
R = ti(loops=1, frames=400, n=96, slope=50e12, tc=60e-6, tf=.02); P('vibration_breath_1chirp', R, 209, statics=S_(209, 25, R), leak=(5, .08), movers=[breather(209, (.1, 1.1, 0), .25, .005)], effects={'vib': vib(120e-6, 7.0)}, truth=[E('radar_vibration', amplitude_m=120e-6, frequency_hz=7.0)], notes='50 chirps/s; platform shakes at 7 Hz')
R = ifx(loops=64, frames=20, n=96, tc=700e-6, tf=.06); P('vibration_ifx', R, 210, statics=S_(210, 20, R), leak=(12, .08), effects={'vib': vib(80e-6, 48.0)}, truth=[E('radar_vibration', amplitude_m=80e-6, frequency_hz=48.0)], notes='real sampling, 48 Hz by 80 um')
R = ti(loops=48, frames=10, tc=150e-6); P('iq_walker', R, 211, statics=S_(211, 30, R), leak=(8, .08), movers=[W(211, (.4, 1.6, 0), (-.3, 3.4, 0), .9)], effects={'iq': [(.04 + .02j)] * 4}, truth=[E('iq_imbalance', gain_db=.68, phase_deg=2.3)], notes='image at -27 dB, same in all receivers')
R = ti(loops=24, frames=10, ntx=2, tc=120e-6); P('iq_static_per_rx', R, 212, statics=S_(212, 30, R, rcs=(-18, 0)), leak=(12, .08), effects={'iq': [.03j, .01, -.025, .015 - .01j]}, truth=[E('iq_imbalance', per_rx_image_db=[-30, -40, -32, -35])], notes='another image in each receiver, -30 to -40 dB')
R = ti(loops=32, frames=10, tc=120e-6); P('dc_static', R, 213, statics=S_(213, 30, R), leak=(3, .2), effects={'dc': lambda R: np.array([30 + 12j, -22 + 5j, 8 - 40j, 15])[None, None, :, None, None]}, truth=[E('dc_offset', ['tx_leakage'], i=30, q=12)], notes='constant offset in each receiver')
R = ifx(loops=48, frames=24); P('dc_creep_ifx', R, 214, statics=S_(214, 25, R), leak=(8, .08), movers=[W(214, (.4, 1.6, 0), (-.3, 3.4, 0), .8)], effects={'dc': lambda R: (25 + 12 * (1 - np.exp(-np.arange(R.L) / 10.)))[None, None, None, :, None]}, truth=[E('dc_offset', ['chirp_settling'], i=25, creep=12)], notes='offset of 25 codes that creeps by 12 more in every frame')
R = ti(loops=48, frames=10, tc=150e-6, write_rail=True, rail=700, k_db=40); P('clip_walker', R, 215, statics=S_(215, 30, R), leak=(38, .08), movers=[W(215, (.2, 1.0, 0), (-.1, 2.4, 0), .8)], effects={'rail': 560}, truth=[E('adc_saturation', ['compression'], level=560)], notes='leakage and a near walker reach the rail of 560 codes in some samples')
R = ifx(loops=24, frames=24); P('clip_ifx', R, 216, statics=S_(216, 25, R), leak=(42, .06), effects={'rail': 235}, truth=[E('adc_saturation', ['compression'], level=235)], notes='real; strong leakage clips at its crests; rail not stated in the recording')
R = ti(loops=32, frames=12, tc=120e-6); P('spur_static', R, 217, statics=S_(217, 30, R), leak=(8, .08), effects={'spur': dict(f=8.43e5 + 317, level=[2.5, 2.0, 2.8, 1.6], phase=[.3, 2., 4., 5.1])}, truth=[E('spur', ['interference'], frequency_hz=8.43317e5, level_codes=2.2)], notes='free-running tone in the IF, -5 dB re noise per sample')
R = ti(loops=16, frames=20, ntx=3, tc=100e-6, tf=.06); P('spur_walker_3tx', R, 218, statics=S_(218, 25, R), leak=(8, .08), movers=[W(218, (.4, 1.6, 0), (-.3, 3.4, 0), .9)], effects={'spur': dict(f=1.31e6 + 41, level=[3, 3, 2.5, 3.5], phase=[.3, .9, 1.6, 2.2], wander_hz=25)}, truth=[E('spur', ['interference'], frequency_hz=1.310041e6, wander_hz=25)], notes='tone whose Doppler wanders by 25 Hz')
R = ifx(loops=32, frames=24); P('spur_ifx', R, 219, statics=S_(219, 25, R), leak=(10, .08), effects={'spur': dict(f=5.0e5, level=[1.6, 1.8, 1.2], phase=[0, .4, .2])}, truth=[E('spur', ['interference', 'dc_offset'], frequency_hz=5e5)], notes='clock tone at exactly fs/4, coherent with the chirps (Doppler 0): looks like a still return at one range')
def near_itf(R, S2, level, az, period, ppm, df0, ramp):
    # a radar of the same kind, its clock off by some ppm: its ramps run nearly in step, the crossing wanders slowly through the window
    q = itf(R, S2, level, az, period * (1 + ppm * 1e-6), ramp=ramp); q['interf']['t0'] = 0.0
    q['interf']['f02'] = R.f0 + R.S * R.adc - S2 * R.adc + df0
    return q
def itf(R, S2, level, az, period, f_off=0.0, ramp=None):
    return dict(interf=dict(S2=S2, f02=R.f0 + f_off, period=period, ramp=ramp or period * .85, t0=1.7e-5, level=level, az_deg=az))
R = ti(loops=32, frames=12, n=128, slope=30e12, tc=100e-6); P('interf_static', R, 220, statics=S_(220, 30, R), leak=(8, .08), effects=near_itf(R, 28.9e12, 70, 20, 100e-6, 1.0, 32e6, 85e-6), truth=[E('interference', ['impulsive_noise'], slope_hz_per_s=28.9e12)], notes='another radar, slope 1.1 MHz/us less, clock off by 1 ppm: bursts of about 11 samples that wander through the window over the recording')
R = ti(loops=32, frames=12, n=128, slope=20e12, tc=120e-6, ntx=2); P('interf_walker', R, 221, statics=S_(221, 30, R), leak=(8, .08), movers=[W(221, (.4, 2.0, 0), (-.3, 5.0, 0), 1.1)], effects=itf(R, 16e12, 160, -25, 71.3e-6), truth=[E('interference', ['impulsive_noise'], slope_hz_per_s=16e12)], notes='another radar, crossings of about 0.9 us')
R = ifx(loops=32, frames=24); P('interf_ifx', R, 222, statics=S_(222, 25, R), leak=(10, .08), effects=itf(R, 15.0e12, 45, 10, 97e-6, ramp=80e-6), truth=[E('interference', ['impulsive_noise'], slope_hz_per_s=15.0e12)], notes='a near-equal slope crosses: bursts of about 3 samples')
def dropped(F, tf, at, n): return np.concatenate([np.arange(at), np.arange(at + n, F + n)]) * tf
FD = ['clock_offset', 'clock_drift', None, 'audit']
R = ti(loops=32, frames=16, tc=150e-6, tf=.05); P('frame_drop_walker', R, 223, statics=S_(223, 30, R), leak=(8, .08), movers=[W(223, (.4, 2.0, 0), (-.3, 5.0, 0), 1.3)], effects={'frame_times': dropped(16, .05, 7, 4)}, truth=[E('frame_drop', FD, at=7, count=4)], also=['moving_reflector'], notes='4 frames are missing before frame 7: the walker jumps by 0.26 m')
R = ti(loops=1, frames=300, n=96, slope=50e12, tc=60e-6, tf=.02); P('frame_drop_fast_1chirp', R, 224, statics=S_(224, 25, R), leak=(8, .08), movers=[vibrator((.2, 1.4, 0), 2.3, .002, -8, .3), breather(224, (-.8, 2.2, 0), .3, .004)], effects={'frame_times': dropped(300, .02, 140, 11)}, truth=[E('frame_drop', FD, at=140, count=11)], notes='11 frames lost; an object swings at 2.3 Hz, a person breathes')
jt = np.arange(300) * .05 + np.random.default_rng(2250).normal(0, .006, 300).clip(-.02, .02) * (np.arange(300) > 0)
R = ti(loops=1, frames=300, n=96, slope=50e12, tc=60e-6, tf=.05); P('frame_jitter_breath', R, 225, statics=S_(225, 25, R), leak=(8, .08), movers=[breather(225, (.1, 1.1, 0), .27, .006), vibrator((-.5, 2.0, 0), 1.6, .003, -10)], effects={'frame_times': jt}, truth=[E('clock_offset', ['clock_drift', 'frame_drop', 'phase_noise', None, 'audit'], word='frame_jitter', offset_s=.006, behaves=['time', 'jitter', 'clock', 'excess', 'slow-time', 'path', 'mov'])], also=['moving_reflector', 'breathing'], notes='frame times jitter by 6 ms rms (USB host); the file says 50 ms')
fj = lambda s: (lambda R, tc, tn, r: R.S * (s * r.standard_normal((R.F,)))[:, None, None, None, None])
JT = ['phase_noise', 'slope_error', 'adc_start_error', 'start_frequency_error', 'if_delay', None]
R = ti(loops=16, frames=24, n=128, slope=60e12, fs=5e6, tc=100e-6, tf=.05); P('delay_jitter_frames', R, 226, statics=S_(226, 30, R, rcs=(-18, 0)), leak=(8, .08), effects={'df': fj(8e-9)}, truth=[E('chirp_start_jitter', JT, jitter_s=8e-9, behaves=['delay', 'phase', 'slow'])], notes='chirp start against the ADC jitters by 8 ns rms from frame to frame, common to a frame: phase proportional to delay')
cj = lambda s: (lambda R, tc, tn, r: R.S * (s * (r.random(tc.shape) < .5))[:, :, None, :, None])
R = ti(loops=32, frames=12, n=128, slope=60e12, fs=5e6, tc=100e-6, nrx=4); P('start_jitter_chirps', R, 227, statics=S_(227, 30, R, rcs=(-12, 4)), leak=(8, .08), effects={'df': cj(4e-9)}, truth=[E('chirp_start_jitter', ['phase_noise'], jitter_s=4e-9)], notes='each chirp starts at 0 or 4 ns at random')
ch = 10 ** (np.array([[0, 2.1, -1.4, 1.0]]) / 20) * np.exp(1j * np.deg2rad([[0, 35, -50, 20]]))
R = ti(loops=48, frames=10, tc=150e-6); P('channels_walker', R, 228, statics=S_(228, 30, R), leak=(8, .08), movers=[W(228, (.4, 2.0, 0), (-.3, 5.0, 0), 1.0)], effects={'channel': ch}, truth=[E('channel_mismatch', ['antenna_position', None], gain_db=[0, 2.1, -1.4, 1.0], phase_deg=[0, 35, -50, 20])], notes='receivers differ by +-2 dB and up to 50 deg')
ch2 = 10 ** (np.array([[0, 1, -3.5, 1.0], [2.5, -2, 0, .5]]) / 20) * np.exp(1j * np.array([[0, 2.4, -1.1, .6], [1.9, -2.6, .3, 2.9]]))
R = ti(loops=24, frames=12, ntx=2, tc=120e-6); P('channels_static_2tx', R, 229, statics=S_(229, 30, R), leak=(8, .08), effects={'channel': ch2}, truth=[E('channel_mismatch', ['antenna_position', 'mutual_coupling', None])], notes='uncalibrated: gains by 4 dB, phases by a full turn, not separable in tx and rx')
def dead_rx(j):
    def f(s, n): s = s.copy(); s[:, :, j] = n[:, :, j] if np.ndim(n) else 0; return s
    return f
def dead_tx(i):
    def f(s, n): s = s.copy(); s[:, i] = n[:, i] if np.ndim(n) else 0; return s
    return f
DC_ = [None, 'audit']
R = ti(loops=48, frames=10, tc=150e-6); P('dead_rx_walker', R, 230, statics=S_(230, 30, R), leak=(8, .08), movers=[W(230, (.4, 2.0, 0), (-.3, 5.0, 0), 1.0)], effects={'dead': dead_rx(2)}, truth=[E('channel_mismatch', DC_, word='dead_channel', rx=2, behaves=['dead', 'channel', 'empty', 'damag', 'missing', 'gain'])], notes='receiver 2 hears only its noise')
R = ti(loops=20, frames=14, ntx=3, tc=100e-6); P('dead_tx_static', R, 231, statics=S_(231, 30, R), leak=(8, .08), effects={'dead': dead_tx(1)}, truth=[E('channel_mismatch', DC_, word='dead_channel', tx=1, behaves=['dead', 'channel', 'empty', 'damag', 'missing', 'gain'])], notes='transmitter 1 is silent: noise only')
GH = ['body_multibounce', 'moving_reflector', None]
R = ti(loops=48, frames=14, ntx=2, tc=100e-6, slope=50e12, fs=4.4e6, tf=.1); P('ghost_room', R, 232, statics=inside(232, 15, ROOM) + room_statics(ROOM, 232), room=ROOM, leak=(5, .06), movers=[W(232, (.9, 2.0, 0), (.6, 4.4, 0), .9)], effects={'ghost': dict(axis=0, at=ROOM['right_m'], coef=.55)}, truth=[E('wall_ghost', GH, boundary='right', coefficient=.55)], notes='right wall mirrors the walker (first and second order), room given')
R = ti(loops=64, frames=10, tc=150e-6, slope=45e12); P('ghost_noroom', R, 233, statics=S_(233, 20, R), leak=(5, .06), movers=[W(233, (-.9, 2.4, 0), (-.5, 4.4, 0), .9)], effects={'ghost': dict(axis=0, at=-2.2, coef=.6)}, truth=[E('wall_ghost', GH, boundary=None, coefficient=.6)], also=['moving_reflector'], notes='a wall 2.2 m to the left mirrors the walker; no room given')
nl = lambda pk: (lambda R, tc, tn, r: (pk * (1.5 * (2 * tn / tn[-1] - 1) ** 2 - .5) * 1.0 + pk * .5 * np.sin(TAU * 1.3 * tn / tn[-1]))[None, None, None, None, :])
R = ti(loops=48, frames=10, n=192, slope=50e12, fs=5e6, tc=150e-6); P('nonlinear_walker', R, 234, statics=S_(234, 30, R, rcs=(-15, 2)), leak=(8, .08), movers=[W(234, (.4, 3.0, 0), (-.3, 6.0, 0), 1.0, rcs=-4)], effects={'df': nl(4e5)}, truth=[E('chirp_nonlinearity', ['chirp_ripple', 'chirp_droop'], peak_hz=4e5)], notes='the sweep bends by 400 kHz (quadratic and a wave of 1.3 periods)')
rp = lambda dv, f: (lambda R, tc, tn, r: (dv * np.cos(TAU * f * tn + .9))[None, None, None, None, :])
R = ti(loops=24, frames=12, n=192, slope=50e12, fs=5e6, tc=120e-6, ntx=2, k_db=38); P('ripple_static', R, 235, statics=statics(235, 18, 8.5, 2.0, rcs=(-8, 4)), leak=(8, .08), effects={'df': rp(3e5, 4.2e5)}, truth=[E('chirp_ripple', ['chirp_nonlinearity'], deviation_hz=3e5, ripple_hz=4.2e5)], notes='sweep frequency ripples at 420 kHz: paired echoes')
R = ti(loops=48, frames=14, slope=60e12, fs=4.4e6, tc=150e-6); P('hpf_walker', R, 236, statics=S_(236, 30, R), leak=(30, .08), movers=[W(236, (.2, .7, 0), (-.1, 3.0, 0), .9)], effects={'hpf': (175e3, 350e3)}, truth=[E('if_highpass', ['if_lowpass', 'if_delay'], corner_hz=[175e3, 350e3], order=2)], notes='high-pass 175/350 kHz, noise shaped too')
R = ifx(loops=32, frames=30); P('hpf_ifx', R, 237, statics=S_(237, 25, R), leak=(40, .08), effects={'hpf': (90e3, 90e3)}, truth=[E('if_highpass', ['if_lowpass', 'coloured_noise'], corner_hz=[90e3, 90e3], order=2)], also=['coloured_noise'], notes='second-order high-pass at 90 kHz; the noise floor falls below it')
R = ti(loops=32, frames=10, ntx=2, tc=150e-6, nrx=4); P('tdm_slot_2tx', R, 238, statics=S_(238, 30, R), leak=(8, .08), movers=[W(238, (.4, 2.0, 0), (-.3, 5.0, 0), 1.4)], effects={'slot': [0, 230e-6]}, truth=[E('tdm_phase', ['clock_offset', 'channel_mismatch', 'antenna_position', None], slot_s=80e-6)], notes='tx 1 fires 80 us later than the file says (230 instead of 150 us)')
R = ti(loops=24, frames=14, ntx=3, tc=110e-6, tf=.06); P('tdm_simultaneous_3tx', R, 239, statics=S_(239, 30, R), leak=(8, .08), movers=[W(239, (-.4, 4.5, 0), (.3, 1.5, 0), 1.5)], effects={'slot': [0, 0, 0]}, truth=[E('tdm_phase', ['clock_offset', 'channel_mismatch', 'antenna_position', None], slot_s=-110e-6)], notes='all tx see the scene at the same instant though the file says TDM')
R = ti(loops=32, frames=12, tc=120e-6, k_db=40); P('settle_step_profile', R, 240, statics=S_(240, 30, R), leak=(8, .08), effects={'gain': lambda tc, tn: (1 - .10 * np.exp(-np.arange(tc.shape[2]) / 4.0) * np.exp(.5j))[None, None, :] + 0 * tc}, truth=[E('chirp_settling', ['gain_drift', None], depth=.10, chirps=4.0)], notes='the first chirps of every frame settle by 10 % (0.5 rad phase of the deviation) (all returns)')
R = ti(loops=32, frames=12, tc=120e-6); P('droop_static', R, 241, statics=S_(241, 30, R, rcs=(-15, 2)), leak=(8, .08), movers=[W(241, (.4, 2.0, 0), (-.3, 4.0, 0), 1.0)], effects={'gain': lambda tc, tn: (10 ** (-1.5 * tn / tn[-1] / 20))[None, None, None, :] + 0 * tc[..., None]}, truth=[E('chirp_droop', ['chirp_nonlinearity', None], db=1.5)], notes='power falls by 1.5 dB along the ramp')

# --------------------------------------------------------------------------------------------- more n
R = ti(loops=1, frames=300, n=96, slope=60e12, tc=60e-6, tf=.02, nrx=2); N('static_1chirp', R, 301, statics=S_(301, 60, R), leak=(10, .09), notes='still, 50 chirps/s, 60 things')
R = ti(loops=64, frames=8, tc=100e-6, k_db=50); N('static_strong', R, 302, statics=S_(302, 30, R), leak=(25, .08), pn=1.0, notes='strong still returns: an ordinary oscillator is seen above the thermal noise')
R = ti(loops=2, frames=200, n=96, ntx=2, tc=80e-6, tf=.05, slope=60e12); N('breath_2tx_2loops', R, 303, statics=S_(303, 30, R), leak=(8, .08), movers=[breather(303, (.2, 1.3, -.1), .21, .0035)], notes='two loops of two tx, a seated person')
R = ifx(loops=16, frames=60, tc=400e-6, tf=.05); N('handheld_ifx', R, 304, statics=S_(304, 20, R), leak=(15, .06), platform=sway(304, .006, (.5, 1.3)), present=['radar_vibration'], notes='handheld, real sampling, 6 mm')
R = ti(loops=32, frames=10, n=96, tc=150e-6, tf=.05, ntx=2, nrx=2); N('vehicle_walker', R, 305, statics=S_(305, 22, R, 2.0, rcs=(-18, 2)), leak=(6, .08), platform=lambda t: np.stack([0 * t, 1.2 * t, 0 * t], -1), movers=[W(305, (-1.5, 5, 0), (1.5, 5.2, 0), 1.2)], also=[], notes='radar moves ahead at 1.2 m/s; a pedestrian crosses')
R = ti(loops=48, frames=20, n=96, tc=150e-6, tf=.1); N('crossing_walkers', R, 306, statics=S_(306, 30, R), leak=(8, .08), movers=[W(306, (-1.2, 3.0, 0), (1.2, 3.1, 0), 1.1), W(1306, (.4, 1.8, 0), (.2, 4.6, 0), 1.2)], notes='two walkers whose ranges meet')
R = ti(loops=32, frames=16, n=128, slope=60e12, fs=4e6, tc=150e-6, tf=.06); N('walker_close', R, 307, statics=S_(307, 25, R), leak=(15, .07), movers=[W(307, (-.9, .55, 0), (.9, .5, 0), .9, rcs=-10)], notes='somebody passes at half a metre')
R = ti(loops=1, frames=360, n=96, slope=50e12, tc=60e-6, tf=.05); N('curtain_1chirp', R, 308, statics=S_(308, 25, R), leak=(8, .08), movers=[parts_at(lambda t: np.stack([.8 + 0 * t, 2.2 + .003 * np.sin(TAU * .13 * t) + .0015 * np.sin(TAU * .37 * t + 1), 0 * t], -1), -10, 'unknown', what='curtain', swing_m=.006)], notes='a curtain moves slowly in the draught')
R = ifx(loops=64, frames=1, tc=500e-6, tf=.1); N('one_frame_ifx_fan', R, 309, statics=S_(309, 20, R), leak=(12, .08), movers=[fan(309, (.4, 1.4, 0), 6.0, blades=3, radius=.15, rcs=-18)], notes='single frame, a fan, real sampling')
R = ti(loops=40, frames=10, n=96, tc=1e-3, tf=.05); N('rotor_steady', R, 310, statics=S_(310, 25, R), leak=(8, .08), movers=[fan(310, (-.3, 1.8, -.1), 25.0, blades=2, radius=.05, rcs=-16, tilt=60)], notes='a small two-bladed rotor at 25 turns/s')
R = ti(loops=3, frames=80, n=128, slope=50e12, tc=100e-6, tf=.05, ntx=1); N('walker_3loops', R, 311, statics=S_(311, 30, R), leak=(8, .08), movers=[W(311, (.5, 1.8, 0), (-.5, 4.5, 0), .8)], notes='three chirps a frame, a walker')
R = ti(loops=32, frames=12, n=100, slope=30e12, tc=120e-6, nrx=4, ntx=2); N('leak_strong_cplx', R, 312, statics=S_(312, 25, R), leak=(40, .12), notes='leakage 40 dB over the noise per sample, differs by channel; still')
R = ti(loops=20, frames=20, n=96, tc=150e-6, tf=.08); N('rain', R, 313, statics=S_(313, 15, R), leak=(8, .08), movers=[dict(kind='unknown', what='rain', parts=[straight((np.random.default_rng([313, i]).uniform(-1, 1), np.random.default_rng([313, i, 1]).uniform(1, 5), 3 + 4 * i / 30), (.3, .1, -5.5))[0:1] + (lambda t: -28 + 0 * t,) for i in range(30)])], notes='drops fall through the field of view')
R = ti(loops=48, frames=10, n=64, slope=12e12, fs=2e6, tc=80e-6, f0=76.5e9); N('walker_long_range', R, 314, statics=statics(314, 40, 20, 2.0, rcs=(-10, 10)), leak=(8, .1), movers=[W(314, (2, 8, 0), (-1, 14, 0), 1.5, rcs=0)], notes='coarse range cells of 39 cm, far walker')
# --------------------------------------------------------------------------------------------- more p
R = ti(loops=16, frames=16, ntx=3, tc=100e-6, tf=.06); P('phase_drift_walker_3tx', R, 401, statics=S_(401, 25, R), leak=(8, .08), movers=[W(401, (.4, 2.0, 0), (-.3, 4.5, 0), 1.0)], effects={'gain': drift(.9, .06)}, truth=[E('gain_drift', PD, word='phase_drift', rad_per_frame=TAU * .9 * .06, behaves=['slow-time', 'phase', 'drift'])], notes='common phase turns by 0.34 rad a frame')
R = ti(loops=64, frames=8, n=64, slope=20e12, fs=2.5e6, tc=120e-6, nrx=1); P('gain_step_1rx', R, 402, statics=S_(402, 25, R), leak=(8, .08), effects={'gain': step(.4, -2.0, -14)}, truth=[E('gain_drift', db=-2.0, rad=-.244, frame=4)], notes='one receiver, step of -2 dB, -14 deg at frame 4')
R = ti(loops=4, frames=150, n=96, slope=50e12, tc=80e-6, tf=.025); P('vibration_twotone', R, 403, statics=S_(403, 25, R), leak=(6, .08), effects={'vib': lambda t: vib(90e-6, 8.1)(t) + vib(50e-6, 13.7, (1, .4, 0), 2.)(t)}, truth=[E('radar_vibration', amplitude_m=90e-6, frequency_hz=8.1, second=dict(amplitude_m=50e-6, frequency_hz=13.7))], notes='platform shakes at 8.1 Hz along, 13.7 Hz across')
R = ti(loops=1, frames=300, n=96, slope=50e12, tc=60e-6, tf=.05); P('iq_breath_1chirp', R, 404, statics=S_(404, 25, R), leak=(10, .08), movers=[breather(404, (.1, 1.1, 0), .25, .005)], effects={'iq': [.05, .04j, .03 + .03j, -.04]}, truth=[E('iq_imbalance', per_rx_image_db=[-26, -28, -27, -28])], notes='image of -27 dB, a seated person')
R = ti(loops=20, frames=12, ntx=3, tc=100e-6, write_rail=True, rail=500); P('clip_3tx_static', R, 405, statics=S_(405, 25, R), leak=(37, .07), effects={'rail': 390}, truth=[E('adc_saturation', ['compression'], level=390)], notes='clipped leakage, TDM, still')
R = ti(loops=1, frames=300, n=128, slope=40e12, tc=60e-6, tf=.05); P('spur_1chirp', R, 406, statics=S_(406, 25, R), leak=(8, .08), movers=[W(406, (-.6, 1.6, 0), (.6, 5.0, 0), .7)], effects={'spur': dict(f=1.62e6 + 3.3, level=[4, 3.5, 5, 4.5], phase=[.1, 1.9, 3.3, 5])}, truth=[E('spur', ['interference'], frequency_hz=1.6200033e6)], notes='free-running tone, one chirp a frame')
R = ti(loops=1, frames=300, n=128, slope=30e12, tc=60e-6, tf=.02); P('interf_1chirp_breath', R, 407, statics=S_(407, 25, R), leak=(8, .08), movers=[breather(407, (.1, 1.1, 0), .25, .005)], effects=near_itf(R, 29.3e12, 60, 35, 50e-6, .4, 21e6, 45e-6), truth=[E('interference', ['impulsive_noise'], slope_hz_per_s=29.3e12)], notes='bursts of about 5 us, one chirp a frame')
jt2 = np.arange(24) * .1 + np.random.default_rng(4080).normal(0, .012, 24).clip(-.03, .03) * (np.arange(24) > 0)
R = ti(loops=32, frames=24, tc=150e-6); P('frame_jitter_walker', R, 408, statics=S_(408, 25, R), leak=(8, .08), movers=[W(408, (.4, 1.6, 0), (-.3, 5.0, 0), 1.2)], effects={'frame_times': jt2}, truth=[E('clock_offset', ['clock_drift', 'frame_drop', None, 'audit'], word='frame_jitter', offset_s=.012, behaves=['time', 'jitter', 'clock', 'excess', 'slow-time', 'path', 'mov'])], also=['moving_reflector'], notes='frame times jitter by 12 ms rms, a walker (hardly to be seen)')
R = ifx(loops=24, frames=30, slope=40e12, n=100, tc=400e-6); P('delay_jitter_ifx', R, 409, statics=statics(409, 25, 3.4, .8), leak=(10, .06), effects={'df': fj(3e-8)}, truth=[E('chirp_start_jitter', JT, jitter_s=3e-8, behaves=['delay', 'phase', 'slow'])], notes='start jitter of 30 ns rms per frame, real sampling')
R = ifx(loops=32, frames=20); P('nonlinear_ifx', R, 410, statics=S_(410, 25, R, rcs=(-10, 4)), leak=(10, .06), movers=[W(410, (.4, 3.0, 0), (-.3, 6.0, 0), .8, rcs=0)], effects={'df': nl(6e5)}, truth=[E('chirp_nonlinearity', ['chirp_ripple', 'chirp_droop'], peak_hz=6e5)], notes='a fast sweep of a cheap PLL bends by 600 kHz')
R = ti(loops=32, frames=10, n=160, slope=60e12, fs=4.4e6, tc=120e-6); P('ripple_walker', R, 411, statics=S_(411, 20, R, rcs=(-12, 4)), leak=(8, .08), movers=[W(411, (.4, 3.0, 0), (-.3, 5.0, 0), 1.0, rcs=0)], effects={'df': rp(4e5, 6.5e5)}, truth=[E('chirp_ripple', ['chirp_nonlinearity'], deviation_hz=4e5, ripple_hz=6.5e5)], notes='sweep frequency ripples at 650 kHz')
R = ifx(loops=48, frames=24); P('ghost_ifx', R, 412, statics=S_(412, 20, R), leak=(12, .08), movers=[W(412, (.6, 2.0, 0), (.3, 4.2, 0), .8)], effects={'ghost': dict(axis=0, at=1.5, coef=.6)}, truth=[E('wall_ghost', GH, boundary=None, coefficient=.6)], also=['moving_reflector'], notes='a wall 1.5 m to the right, real sampling, no room given')
R = ti(loops=20, frames=12, ntx=2, slope=60e12, fs=4.4e6, tc=100e-6); P('hpf_static_2tx', R, 413, statics=S_(413, 40, R, .4), leak=(30, .08), effects={'hpf': (300e3, 300e3)}, truth=[E('if_highpass', ['if_lowpass', 'if_delay', 'coloured_noise'], corner_hz=[300e3, 300e3], order=2)], also=['coloured_noise'], notes='second-order high-pass at 300 kHz; still')
def zero_rx(j):
    def f(s, n): s = s.copy(); s[:, :, j] = 0; return s
    return f
R = ifx(loops=32, frames=24); P('zero_rx_ifx', R, 414, statics=S_(414, 25, R), leak=(10, .08), movers=[W(414, (.4, 1.6, 0), (-.3, 3.4, 0), .8)], effects={'dead': zero_rx(1)}, truth=[E('channel_mismatch', DC_, word='dead_channel', rx=1, behaves=['dead', 'channel', 'empty', 'zero', 'damag', 'missing', 'gain'])], notes='receiver 1 delivers exact zeros')
R = ti(loops=64, frames=10, n=96, tc=500e-6, tf=.05); P('gain_mains_walker', R, 415, statics=S_(415, 30, R), leak=(8, .08), movers=[W(415, (.4, 2.0, 0), (-.3, 4.0, 0), .8)], effects={'gain': ripple(.25, 100.3, 2.0)}, truth=[E('gain_drift', [None, 'radar_vibration', 'phase_noise'], word='gain_ripple', db=.25, rad=.035, rate_hz=100.3, behaves=['slow-time', 'gain'])], notes='mains ripple of 0.25 dB and 2 deg on all returns')
R = ti(loops=128, frames=1, n=128, tc=150e-6, tf=.1); P('iq_one_frame', R, 416, statics=S_(416, 30, R), leak=(8, .08), movers=[W(416, (.5, 2.0, 0), (.1, 5, 0), 1.2)], effects={'iq': [.04] * 4}, truth=[E('iq_imbalance', gain_db=.69, phase_deg=0)], notes='a single frame, image of -28 dB')


def main():
    out, only = sys.argv[1], sys.argv[2:]
    for name, (R, seed, k), _ in [(n, a, kk) for n, a, kk in CASES]:
        if only and not any(name.startswith(o) for o in only):
            continue
        t = time.time()
        k = dict(k)
        if name.startswith('n_'):
            k.setdefault('must_not', [e for e in NOHW if e not in k.get('present', ()) and e not in k.get('also', ())])
        c = Case(name, R, seed, **k)
        tr = write(c, out); sz, mx, rms = validate(name, out)
        print(f"{name:28s} {sz/1e6:5.1f} MB max {mx:5d} rms {rms:6.1f} snr {tr['strongest_cell_over_noise_db']:5.1f} effect {tr.get('effect_strength', {}).get('strongest_cell_of_the_difference_over_noise_db')} {tr.get('effect_strength', {}).get('mean_power_of_the_difference_over_noise_db')} {time.time()-t:4.1f}s", flush=True)


if __name__ == '__main__':
    main()
