"""Recordings of FMCW radars by a generator that shares nothing with the recorder or the simulator (NumPy only).

Every path: exp(j 2 pi (fc tau + S t tau - S tau^2 / 2)), fc = f0 + S adc_start, t from the start of the ADC window, tau(t) exact at the first
and the last sample of every chirp (bistatic, both antennas, platform motion) and linear between (error < 1e-4 rad). Amplitude
K sqrt(rcs) / (d_tx d_rx). LO errors df(t) (phase noise, sweep errors, start jitter) multiply each path by exp(j 2 pi tau df), to 2nd order.
"""
import json, os, tomllib
import numpy as np

C = 299792458.0


def rng_of(seed, k):
    return np.random.default_rng([seed, k])


# ------------------------------------------------------------------------------------------------ radar
class Radar:
    def __init__(self, f0, slope, fs, n, loops, frames, tc, tf, adc=6e-6, real=False, ntx=1, nrx=4, tx=None, rx=None,
                 sigma=4.0, k_db=35.0, rail=32767, write_rail=False, pos=(0, 0, 0), bits_offset=0):
        lam = C / (f0 + slope * adc + slope * n / fs / 2)
        self.f0, self.S, self.fs, self.N, self.L, self.F, self.tc, self.tf, self.adc = f0, slope, fs, n, loops, frames, tc, tf, adc
        self.real, self.lam = real, lam
        self.rx = np.array(rx if rx is not None else [[i * lam / 2, 0, 0] for i in range(nrx)], float)
        self.tx = np.array(tx if tx is not None else [[-(ntx - i) * nrx * lam / 2 * (1 if i != 1 or ntx < 3 else 1), 0, 0] for i in range(ntx)], float)
        if tx is None and ntx == 3:
            self.tx[1, 2] = lam / 2
        self.T, self.R = len(self.tx), len(self.rx)
        self.sigma, self.K = sigma, sigma * 10 ** (k_db / 20)          # noise per real part, codes; amplitude of 0 dBsm at 1 m
        self.rail, self.write_rail, self.pos, self.offset = rail, write_rail, np.array(pos, float), bits_offset
        self.rmax = fs * C / 2 / abs(slope) / (2 if real else 1)
        self.res = C / 2 / (abs(slope) * n / fs)
        self.vmax = lam / 4 / (tc * self.T)
        assert adc + n / fs <= tc + 1e-12, (adc + n / fs, tc)
        assert loops * self.T * tc <= tf + 1e-12, (loops * self.T * tc, tf)

    def times(self, frame_times=None, slot=None):
        """ramp start of every chirp, [F,T,L]"""
        k = np.arange(self.F) * self.tf if frame_times is None else np.asarray(frame_times)
        s = np.arange(self.T) * self.tc if slot is None else np.asarray(slot)
        return k[:, None, None] + s[None, :, None] + (np.arange(self.L) * self.T * self.tc)[None, None, :]

    def describe(self):
        return (f"{self.f0/1e9:.1f} GHz {self.T}tx {self.R}rx {'real' if self.real else 'cplx'} S={self.S/1e12:.1f} N={self.N} L={self.L} "
                f"F={self.F} tc={self.tc*1e6:.0f}us tf={self.tf*1e3:.0f}ms dR={self.res*100:.0f}cm Rmax={self.rmax:.1f}m vmax={self.vmax:.2f}")


def ti(loops=64, frames=12, n=128, slope=30e12, fs=4e6, tc=100e-6, tf=0.1, ntx=1, nrx=4, f0=77e9, **k):
    return Radar(f0, slope, fs, n, loops, frames, tc, tf, adc=6e-6, ntx=ntx, nrx=nrx, **k)


def ifx(loops=32, frames=40, n=128, slope=15.6e12, fs=2e6, tc=400e-6, tf=0.05, nrx=3, f0=60e9, **k):
    lam = C / 60.5e9
    rx = [[lam / 2, 0, 0], [0, 0, lam / 2], [lam / 2, 0, lam / 2]][:nrx]
    k.setdefault('sigma', 2.0)
    return Radar(f0, slope, fs, n, loops, frames, tc, tf, adc=0.0, real=True, tx=[[0, 0, 0]], rx=rx, **k)


# ------------------------------------------------------------------------------------------------ scenes
def statics(seed, n, rmax, rmin=0.8, rcs=(-27, -4), near=None):
    r = rng_of(seed, 1)
    out = []
    for _ in range(n):
        d, az, z = r.uniform(rmin, rmax), np.deg2rad(r.uniform(-60, 60)), r.uniform(-0.8, 1.2)
        h = np.sqrt(max(d * d - z * z, 0.01))
        out.append((np.array([h * np.sin(az), h * np.cos(az), z]), r.uniform(*rcs), r.uniform(0, 2 * np.pi)))
    return out


def room_statics(room, seed, rcs=6):
    """specular returns of the walls (an image of the radar: delay 2d/c) plus two corners"""
    r = rng_of(seed, 2)
    v = {'left_m': (-1, 0, 0), 'right_m': (1, 0, 0), 'front_m': (0, 1, 0), 'back_m': (0, -1, 0), 'floor_m': (0, 0, -1), 'ceiling_m': (0, 0, 1)}
    out = []
    for k, d in room.items():
        w = {'front_m': rcs, 'back_m': -20}.get(k, rcs - 12)
        out.append((np.array(v[k], float) * d, w, r.uniform(0, 6.28)))
    f = room['front_m']
    for s in ('left_m', 'right_m'):
        out.append((np.array([v[s][0] * room[s], f, 0.2]), rcs - 8, r.uniform(0, 6.28)))
    return out


def line(p0, p1, v, t0=0.0):
    """back and forth between p0 and p1 at speed v with rounded turns; returns position and unit heading functions"""
    p0, p1 = np.array(p0, float), np.array(p1, float)
    d = np.linalg.norm(p1 - p0)

    def s(t):
        u = ((t - t0) * v / d) % 2.0
        tri = np.where(u < 1, u, 2 - u)
        return tri + 0.02 * np.sin(2 * np.pi * tri)                    # a little slower at the turns
    return (lambda t: p0 + (p1 - p0) * s(t)[..., None]), (p1 - p0) / d


def straight(p0, vel):
    p0, vel = np.array(p0, float), np.array(vel, float)
    return (lambda t: p0 + vel * t[..., None]), vel / np.linalg.norm(vel)


def walker(seed, traj, v, rcs=-8.0, kind='walking', act=None):
    pos, head = traj
    r = rng_of(seed, 3)
    f = 0.6 * np.sqrt(max(v, .2)) + 0.25                               # stride rate
    ph = r.uniform(0, 2 * np.pi)
    side = np.array([head[1], -head[0], 0.0])
    parts = []

    def part(off_h, off_s, z, swing, phase, rel, harm=0.25):
        a1, w1 = r.uniform(.2, .35), r.uniform(0, 6.28)

        def p(t):
            w = 2 * np.pi * f * t + ph + phase
            on = 1.0 if act is None else act(t)                         # 0: stands, 1: walks
            sw = on * swing * (np.sin(w) + harm * np.sin(2 * w + 0.6))
            bob = on * 0.02 * np.sin(2 * (2 * np.pi * f * t + ph))
            lift = on * 0.4 * swing * np.maximum(np.cos(w), 0) if z < -0.5 else 0
            q = pos(t) + head * (off_h + sw)[..., None] + side * off_s
            q[..., 2] += z + bob + lift
            return q
        parts.append((p, lambda t: rcs + rel + 3 * np.sin(2 * np.pi * a1 * t + w1) + 2 * np.sin(2 * np.pi * 2 * f * t + w1 * 2)))
    part(0.0, 0.0, 0.25, 0.015, 0, 0)           # chest
    part(0.03, 0.05, 0.0, 0.02, 1.0, -4)        # belly
    part(0.0, -0.06, -0.2, 0.03, 2.0, -6)       # pelvis
    part(0.02, 0.0, 0.6, 0.01, 0.5, -10)        # head
    for s, p0 in ((1, 0), (-1, np.pi)):
        part(0.0, 0.25 * s, 0.0, 0.10, p0, -13)          # elbow
        part(0.05, 0.27 * s, -0.2, 0.22, p0, -15)        # hand
        part(0.0, 0.10 * s, -0.5, 0.14, p0 + np.pi, -11) # knee
        part(0.0, 0.12 * s, -0.9, 0.33, p0 + np.pi, -13) # foot
    return {'kind': kind, 'parts': parts, 'speed_mps': v}


def breather(seed, p, rate=0.26, swing=0.004, rcs=-9.0, heart=1.15):
    p = np.array(p, float)
    u = -p / np.linalg.norm(p)
    r = rng_of(seed, 4)
    w = r.uniform(0, 6.28)
    d1, d2, wd = r.uniform(.05, .09), r.uniform(.01, .03), r.uniform(0, 6.28)

    def b(t):
        x = 2 * np.pi * rate * t + 0.25 * np.sin(2 * np.pi * d2 * t + wd) + w      # rate wanders a little
        return np.sin(x) + 0.15 * np.sin(2 * x + 1)
    parts = []
    for off, g, rel in ((0, 1, 0), (0.06, .7, -5), (0.15, .25, -8), (-0.05, .05, -12)):
        o = np.array([r.uniform(-.2, .2), off, off * 2 - 0.1])

        def pp(t, o=o, g=g):
            m = g * 0.5 * swing * b(t) + g * 1.2e-4 * np.sin(2 * np.pi * heart * t + w) + 3e-4 * np.sin(2 * np.pi * d1 * t + wd)
            return p + o + u * m[..., None]
        parts.append((pp, lambda t, rel=rel: rcs + rel + 0 * t))
    return {'kind': 'breathing', 'parts': parts, 'rate_hz': rate, 'swing_m': swing}


def vibrator(p, rate, amp, rcs=-15.0, harm=0.0):
    p = np.array(p, float); u = -p / np.linalg.norm(p)
    return {'kind': 'vibrating', 'rate_hz': rate, 'swing_m': 2 * amp, 'parts': [
        (lambda t: p + u * (amp * (np.sin(2 * np.pi * rate * t) + harm * np.sin(4 * np.pi * rate * t + 1)))[..., None], lambda t: rcs + 0 * t)]}


def fan(seed, p, rate, blades=3, radius=0.2, rcs=-24.0, tilt=35):
    p = np.array(p, float); r = rng_of(seed, 5)
    u = p / np.linalg.norm(p); n = np.deg2rad(tilt)
    e1 = np.cos(n) * np.cross(u, [0, 0, 1.0]) + np.sin(n) * u          # the disk is turned by `tilt` from facing the radar
    e2 = np.array([0, 0, 1.0])
    parts = []
    for b in range(blades):
        for q in (0.35, 0.65, 1.0):
            def pp(t, b=b, q=q):
                a = 2 * np.pi * (rate * t + b / blades)
                return p + radius * q * (np.cos(a)[..., None] * e1 + np.sin(a)[..., None] * e2)
            parts.append((pp, lambda t, b=b: rcs + 4 * np.cos(2 * np.pi * (rate * t + b / blades))))
    return {'kind': 'rotating', 'parts': parts, 'rate_hz': rate, 'blade_rate_hz': rate * blades, 'tip_speed_mps': 2 * np.pi * rate * radius}


def door(p_hinge, width=0.85, t0=0.3, dur=2.5, deg=65, rcs=-14.0, a0=0.1):
    h = np.array(p_hinge, float)
    parts = []
    for q in np.linspace(0.15, 1, 7):
        for z in (-.4, .3):
            def pp(t, q=q, z=z):
                x = np.clip((t - t0) / dur, 0, 1); a = a0 + np.deg2rad(deg) * (3 * x * x - 2 * x ** 3)
                return h + np.stack([q * width * np.cos(a), -q * width * np.sin(a), z + 0 * a], -1)
            parts.append((pp, lambda t: rcs + 0 * t))
    return {'kind': 'unknown', 'what': 'door', 'parts': parts}


def vegetation(seed, n, r0, r1, rcs=-26.0, amp=(0.001, 0.012)):
    r = rng_of(seed, 6); parts = []
    for _ in range(n):
        d, az = r.uniform(r0, r1), np.deg2rad(r.uniform(-35, 35))
        p = np.array([d * np.sin(az), d * np.cos(az), r.uniform(-.6, .8)])
        f, w, a = r.uniform(.3, 3.0, 3), r.uniform(0, 6.28, 3), r.uniform(*amp, 3) * [1, .5, .3]
        u = r.normal(size=3); u /= np.linalg.norm(u)

        def pp(t, p=p, f=f, w=w, a=a, u=u):
            m = sum(a[i] * np.sin(2 * np.pi * f[i] * t + w[i]) for i in range(3))
            return p + u * m[..., None]
        g = rcs + r.normal() * 4
        parts.append((pp, lambda t, g=g: g + 0 * t))
    return {'kind': 'unknown', 'what': 'vegetation', 'parts': parts, 'doppler_spread_mps': float(2 * np.pi * 1.6 * np.mean(amp))}


def parts_at(f, rcs, kind='unknown', **k):
    return dict({'kind': kind, 'parts': [(f, lambda t: rcs + 0 * t)]}, **k)


# ------------------------------------------------------------------------------------------------ simulation
class Case:
    def __init__(self, name, radar, seed, statics=(), movers=(), leak=None, platform=None, effects=None, room=None, pn=1.0, pn_red=0.0,
                 truth=None, also=(), present=(), must_not=(), notes='', gone=None, valid=None, dtype='int16', labels=None):
        self.__dict__.update(locals()); del self.__dict__['self']
        self.effects = effects or {}; self.truth = truth or []


def hpf(fb, corners):
    h = np.ones_like(fb, complex)
    for c in corners:
        h = h * (1j * fb / c) / (1 + 1j * fb / c)
    return h


def simulate(case, fx, noise=True, pn=True):
    R = case.radar; F, T, Rx, L, N = R.F, R.T, R.R, R.L, R.N
    tn = np.arange(N) / R.fs; span = (N - 1) / R.fs
    fc = R.f0 + R.S * R.adc
    tc = R.times(fx.get('frame_times', case.gone if case.gone is not None else None), fx.get('slot'))
    ta, tb = tc + R.adc, tc + R.adc + span                                              # [F,T,L]
    # LO errors df [F,T,1,L,N]: baseline phase noise + effects
    df = np.zeros((F, T, 1, L, 1), np.float32)
    r = rng_of(case.seed, 11)
    if case.pn and pn:                                                                  # white FM shaped by a PLL (high-passed below 300 kHz)
        w = r.standard_normal((F, T, 1, L, N)).astype(np.float32)
        f = np.fft.rfftfreq(N, 1 / R.fs); sh = np.sqrt((0.03 + (f / 3e5) ** 2) / (1 + (f / 3e5) ** 2)) / np.sqrt(1 + (f / 3e6) ** 2)
        df = df + case.pn * np.fft.irfft(np.fft.rfft(w) * sh, N).astype(np.float32) * np.float32(np.sqrt(10 ** -9.5 * 1e12 * R.fs))
        slow = r.standard_normal((F, T, L)) * 1.5e3                                     # per chirp, Hz
        df = df + (case.pn * slow)[:, :, None, :, None].astype(np.float32)
    if case.pn_red and pn:                                                                     # random walk of frequency over absolute time
        o = np.argsort(tc, axis=None); t = tc.ravel()[o]
        st = np.sqrt(np.diff(t, prepend=t[0])) * r.standard_normal(t.size)
        x = np.empty(t.size); x[o] = np.cumsum(st); x = x.reshape(tc.shape)
        df = df + (case.pn_red * (x - x.mean()))[:, :, None, :, None].astype(np.float32)
    if 'df' in fx:
        df = df + fx['df'](R, tc, tn, rng_of(case.seed, 12)).astype(np.float32)
    use_df = bool(np.any(df))
    S0 = np.zeros((F, T, Rx, L, N), np.complex64)
    S1 = np.zeros_like(S0) if use_df else None
    S2 = np.zeros_like(S0) if use_df else None
    H = (lambda tau: hpf(R.S * tau, fx['hpf'])) if 'hpf' in fx else (lambda tau: 1.0)

    def add(ta_, tb_, amp):
        """delays at first and last sample, any broadcastable [F|1,T,R,L|1]"""
        b = (tb_ - ta_) / span
        c0 = fc * ta_ - R.S * ta_ ** 2 / 2; c0 = c0 - np.rint(c0)
        c1 = fc * b + R.S * ta_ - R.S * ta_ * b
        c2 = R.S * b - R.S * b * b / 2
        cy = c0[..., None] + c1[..., None] * tn + c2[..., None] * tn ** 2
        cy -= np.rint(cy)
        e = np.exp((2j * np.pi) * cy.astype(np.float32)).astype(np.complex64) * (amp * H(ta_))[..., None].astype(np.complex64)
        np.add(S0, e, out=S0)
        if use_df:
            e = e * ta_[..., None].astype(np.float32); np.add(S1, e, out=S1)
            e = e * ta_[..., None].astype(np.float32); np.add(S2, e, out=S2)

    plat = [p for p in (case.platform, fx.get('vib')) if p is not None]
    d = lambda t: sum((p(t) for p in plat), np.zeros(t.shape + (3,)))
    base = R.pos

    def dist(p, ant, t):
        return np.linalg.norm(p - (base + ant + d(t)), axis=-1)

    def legs(f, t):
        p = f(t)                                                                         # [F,T,L,3]
        dt = np.stack([dist(p[:, i], R.tx[i], t[:, i]) for i in range(T)], 1)[:, :, None]   # [F,T,1,L]
        dr = np.stack([dist(p, R.rx[j], t) for j in range(Rx)], 2)                       # [F,T,R,L]
        return dt, dr
    for p, g, ph in case.statics:
        a0 = R.K * 10 ** (g / 20) * np.exp(1j * ph)
        if plat:
            f = lambda t: np.broadcast_to(p, t.shape + (3,))
            (x, y), (x2, y2) = legs(f, ta), legs(f, tb)
            add((x + y) / C, (x2 + y2) / C, a0 / (x * y))
        else:
            x = np.linalg.norm(p - base - R.tx, axis=-1)[None, :, None, None]; y = np.linalg.norm(p - base - R.rx, axis=-1)[None, None, :, None]
            add((x + y) / C, (x + y) / C, a0 / (x * y))
    gh = fx.get('ghost')
    for m in case.movers:
        for k, (f, g) in enumerate(m['parts']):
            a0 = R.K * 10 ** (g(tc) / 20)[:, :, None]
            (x, y), (x2, y2) = legs(f, ta), legs(f, tb)
            add((x + y) / C, (x2 + y2) / C, a0 / (x * y))
            if gh:
                ax, w = gh['axis'], gh['at']

                def fm(t, f=f):
                    q = np.array(f(t)); q[..., ax] = 2 * w - q[..., ax]; return q
                (u, v), (u2, v2) = legs(fm, ta), legs(fm, tb)
                add((x + v) / C, (x2 + v2) / C, gh['coef'] * a0 / (x * v))
                add((u + y) / C, (u2 + y2) / C, gh['coef'] * a0 / (u * y))
                add((u + v) / C, (u2 + v2) / C, gh['coef'] ** 2 * a0 / (u * v))
    if case.leak:
        r = rng_of(case.seed, 13); lv, rg = case.leak                                    # dB over the noise (per sample), metres
        w = r.uniform(0, 2 * np.pi, (1, T, Rx, 1)); g = r.normal(0, 1.5, (1, T, Rx, 1)); dl = r.uniform(-.01, .01, (1, T, Rx, 1))
        tau = 2 * (rg + dl) / C
        add(tau, tau, R.sigma * np.sqrt(2 if not R.real else 1) * 10 ** ((lv + g) / 20) * np.exp(1j * w))
    s = S0
    if use_df:
        x = np.float32(2 * np.pi) * df
        s = S0 + 1j * x * S1 - (x * x / 2) * S2
        s = s.astype(np.complex64)
    if 'channel' in fx:
        s = s * fx['channel'][None, :, :, None, None].astype(np.complex64)
    r = rng_of(case.seed, 14)
    gain = None
    if 'gain' in fx:
        gain = fx['gain'](tc, tn)
        gain = gain[:, :, None] if gain.ndim == 4 else gain[:, :, None, :, None]
        if not fx.get('gain_noise'):
            s = s * gain.astype(np.complex64)
    if 'interf' in fx:
        s = s + interference(R, tc, tn, fx['interf'], rng_of(case.seed, 15))
    if noise:
        n = r.standard_normal(s.shape).astype(np.float32)
        if not R.real:
            n = n + 1j * r.standard_normal(s.shape).astype(np.float32)
        if 'hpf' in fx:
            f = np.fft.fftfreq(N, 1 / R.fs); n = np.fft.ifft(np.fft.fft(n) * hpf(f, fx['hpf']))
            n = n.real if R.real else n
        n = (R.sigma * n).astype(np.float32 if R.real else np.complex64)
    else:
        n = 0
    if R.real:
        s = s.real
    if 'spur' in fx:
        q = fx['spur']; ab = (tc + R.adc)[:, :, None, :, None] + tn
        wob = q.get('wander_hz', 0) * 0.5 * np.sin(2 * np.pi * 0.7 * tc)[:, :, None, :, None] / 0.7
        cy = q['f'] * ab + wob; cy -= np.rint(cy)
        w = np.exp(2j * np.pi * cy.astype(np.float32)) * (np.asarray(q['level']) * np.exp(1j * np.asarray(q['phase'])))[None, None, :, None, None]
        s = s + (w.real if R.real else w).astype(s.dtype)
    s = s + n
    if gain is not None and fx.get('gain_noise'):
        s = s * (gain.real if R.real else gain)
    if 'iq' in fx:
        s = s + np.asarray(fx['iq'])[None, None, :, None, None] * np.conj(s)
    if 'dead' in fx:
        s = fx['dead'](s, n)
    if 'dc' in fx:
        dc = fx['dc'](R)
        s = s + dc
    s = s + (R.offset if R.real else 0)
    lo, hi = (-R.rail - 1, R.rail) if not R.offset else (0, R.rail)
    if 'rail' in fx:
        lo, hi = -fx['rail'] - 1, fx['rail']
    if R.real:
        return np.clip(np.rint(s), lo, hi)
    return np.clip(np.rint(s.real), lo, hi) + 1j * np.clip(np.rint(s.imag), lo, hi)


def interference(R, tc, tn, q, r):
    """other radar's ramps: f02 + S2 u, repeated every period; only while its beat is inside the IF band"""
    out = np.zeros(tc.shape[:2] + (R.R,) + tc.shape[2:] + (len(tn),), np.complex64)
    fc = R.f0 + R.S * R.adc
    az = np.deg2rad(q['az_deg']); u = np.array([np.sin(az), np.cos(az), 0])
    st = np.exp(-2j * np.pi * (R.rx @ u) / R.lam)[None, None, :, None, None]
    hits = np.zeros(tc.shape, int)
    t = (tc + R.adc)[..., None] + tn                                                      # absolute
    k = np.floor((t - q['t0']) / q['period']); uu = t - q['t0'] - k * q['period']
    on = uu < q['ramp']
    dl = q['f02'] + q['S2'] * uu - (fc + R.S * tn)                                        # difference of the two frequencies
    w = np.exp(-(dl / (0.42 * R.fs)) ** 8) * on
    ph = 2 * np.pi * ((q['f02'] - fc) * tn - R.S * tn ** 2 / 2 + q['S2'] * uu ** 2 / 2)   # its own random phase per ramp and chirp
    ph = ph + 2 * np.pi * ((k * 0.754877666) % 1.0) + 2 * np.pi * r.random(tc.shape)[..., None]
    b = (q['level'] * w * np.exp(-1j * ph)).astype(np.complex64)
    hits = (w > .5).sum(-1)
    q['chirps_hit'] = int((hits > 0).sum()); q['samples_hit_median'] = float(np.median(hits[hits > 0])) if (hits > 0).any() else 0
    out += b[:, :, None] * st
    return out


# ------------------------------------------------------------------------------------------------ strength, writing, validation
def rd_peak(x, R):
    """strongest range-Doppler cell over the thermal floor, dB (Hann; channels averaged), and mean power over noise"""
    nv = R.sigma ** 2 * (1 if R.real else 2)
    if R.L >= 8:
        y = x
    else:
        y = np.moveaxis(x, 0, 2).reshape(1, R.T, R.R, R.F * R.L, R.N)
    w = np.hanning(R.N + 2)[1:-1]; v = np.hanning(y.shape[3] + 2)[1:-1]
    best = 0.0
    for k in range(y.shape[0]):
        z = np.fft.fft2(y[k] * w * v[:, None], axes=(-2, -1))
        best = max(best, float((np.abs(z) ** 2).mean((0, 1)).max()))
    return 10 * np.log10(max(best, 1e-12) / (nv * (w ** 2).sum() * (v ** 2).sum())), 10 * np.log10(max(float((np.abs(x) ** 2).mean()), 1e-12) / nv)


def num(v):
    return repr(float(v))


def toml(case):
    R = case.radar
    v3 = lambda a: '[' + ', '.join('[' + ', '.join(f'{x:.7f}' for x in p) + ']' for p in a) + ']'
    o = ['format = 1', '', '[radar]', f'start_frequency_hz = {num(R.f0)}', f'slope_hz_per_s = {num(R.S)}', f'sample_rate_hz = {num(R.fs)}',
         f'sampling = "{"real" if R.real else "complex"}"', f'samples_per_chirp = {R.N}', f'loops_per_frame = {R.L}', f'adc_start_s = {num(R.adc)}',
         f'chirp_period_s = {num(R.tc)}', f'frame_period_s = {num(R.tf)}', f'frames = {R.F}', f'position_m = [{", ".join(num(x) for x in R.pos)}]',
         f'tx_m = {v3(R.tx)}', f'rx_m = {v3(R.rx)}']
    if R.write_rail:
        o.append(f'full_scale_codes = {R.rail if "rail" not in case.effects else case.effects["rail"]}')
    if case.room:
        o += ['', '[room]'] + [f'{k} = {num(v)}' for k, v in case.room.items()]
    o += ['', '[files]', 'if = "if.npy"'] + (['valid = "valid.npy"'] if case.valid is not None else [])
    if case.labels:
        o += ['', '[labels]'] + [f'{k} = "{v}"' for k, v in case.labels.items()]
    return '\n'.join(o) + '\n'


def write(case, out):
    R = case.radar
    d = os.path.join(out, 'cases', case.name); os.makedirs(d, exist_ok=True)
    x = simulate(case, case.effects)
    if case.valid is not None:
        v = case.valid(R, rng_of(case.seed, 16)); x = x * v[..., None]; np.save(os.path.join(d, 'valid.npy'), v)
    truth = {'effects': case.truth, 'movers': [], 'present': list(case.present), 'also': list(case.also), 'must_not': list(case.must_not), 'notes': case.notes,
             'structure': R.describe(), 'seed': case.seed, 'leakage': {'range_m': case.leak[1], 'level_over_noise_per_sample_db': case.leak[0]} if case.leak else None,
             'n_statics': len(case.statics), 'noise_sigma_codes_per_real_part': R.sigma}
    if case.effects:
        base = simulate(case, {})
        pk, mean = rd_peak(x - base, R)
        truth['effect_strength'] = {'strongest_cell_of_the_difference_over_noise_db': round(pk, 1), 'mean_power_of_the_difference_over_noise_db': round(mean, 1)}
    if case.pn or case.pn_red:
        y = simulate(case, case.effects, noise=False); z = simulate(case, case.effects, noise=False, pn=False)
        pk, mean = rd_peak(y - z, R)
        truth['phase_noise_strength'] = {'strongest_cell_over_thermal_db': round(pk, 1), 'mean_power_over_thermal_db': round(mean, 1)}
        if pk > -3 and 'phase_noise' not in truth['present']:
            truth['present'] += ['phase_noise', 'coloured_noise']
            truth['must_not'] = [e for e in truth['must_not'] if e not in truth['present']]
    ids = set(truth['present']) | set(truth['also'])
    for e in truth['effects']:
        ids |= {e['name'] or 'unnamed'} | {a or 'unnamed' for a in e['accept']}
    for m in case.movers:
        ids |= {'moving_reflector'} | ({'breathing', 'heartbeat'} if m['kind'] == 'breathing' else set())
    if case.leak:
        ids.add('tx_leakage')
    if case.statics:
        ids.add('static_reflector')
    truth['true_ids'] = sorted(ids)
    truth['must_not'] = [e for e in truth['must_not'] if e not in ids]
    if 'interf' in case.effects:
        truth['interference'] = {k: case.effects['interf'][k] for k in ('chirps_hit', 'samples_hit_median', 'period', 'ramp', 'S2', 'level')}
    if 'rail' in case.effects:
        lim = case.effects['rail']
        truth['clipped_share_of_real_parts'] = round(float(np.mean([(np.abs(v) >= lim).mean() for v in ((x,) if R.real else (x.real, x.imag))])), 4)
    pk, mean = rd_peak(x - (R.offset if R.real else 0), R)
    truth['strongest_cell_over_noise_db'] = round(pk, 1)
    tc = R.times(case.effects.get('frame_times', case.gone))
    for m in case.movers:
        q = {k: v for k, v in m.items() if k != 'parts'}
        pl = (lambda t: case.platform(t)) if case.platform is not None else (lambda t: 0.0)
        lo, hi, vl, vh = [], [], [], []
        for f, g in m['parts']:
            rr = np.linalg.norm(f(tc) - R.pos - pl(tc), axis=-1); r2 = np.linalg.norm(f(tc + 1e-3) - R.pos - pl(tc + 1e-3), axis=-1)
            lo.append(rr.min()); hi.append(rr.max()); vv = (r2 - rr) / 1e-3; vl.append(vv.min()); vh.append(vv.max())
        q['range_m'] = [round(float(min(lo)), 3), round(float(max(hi)), 3)]
        q['main_part_range_m'] = [round(float(lo[0]), 3), round(float(hi[0]), 3)]
        q['velocity_mps'] = [round(float(min(vl)), 3), round(float(max(vh)), 3)]
        f, g = m['parts'][0]; rr = np.linalg.norm(f(tc) - R.pos, axis=-1)
        q['main_part_snr_per_sample_db'] = round(float(20 * np.log10(R.K / R.sigma / (1 if R.real else np.sqrt(2))) + np.median(g(tc) - 40 * np.log10(rr))) - (3 if R.real else 0), 1)
        truth['movers'].append(q)
    if R.real:
        a = x.astype('<i2')
    else:
        a = np.stack([x.real, x.imag], -1).astype('<i2')
    np.save(os.path.join(d, 'if.npy'), a)
    open(os.path.join(d, 'recording.toml'), 'w').write(toml(case))
    os.makedirs(os.path.join(out, 'truth'), exist_ok=True)
    json.dump(truth, open(os.path.join(out, 'truth', case.name + '.json'), 'w'), indent=1, default=lambda v: v.tolist() if hasattr(v, 'tolist') else str(v))
    return truth


RADAR_KEYS = set('start_frequency_hz slope_hz_per_s sample_rate_hz sampling samples_per_chirp loops_per_frame adc_start_s chirp_period_s frame_period_s frames position_m tx_m rx_m full_scale_codes'.split())


def validate(name, out):
    d = os.path.join(out, 'cases', name)
    t = tomllib.load(open(os.path.join(d, 'recording.toml'), 'rb')); r = t['radar']
    assert t['format'] == 1 and set(t) <= {'format', 'radar', 'room', 'files', 'labels'}, t.keys()
    assert set(r) <= RADAR_KEYS and RADAR_KEYS - set(r) <= {'full_scale_codes'}, set(r) ^ RADAR_KEYS
    assert all(v > 0 for v in t.get('room', {}).values()) and set(t.get('room', {})) <= {k + '_m' for k in 'left right front back floor ceiling'.split()}
    a = np.load(os.path.join(d, t['files']['if']), mmap_mode='r')
    sh = (r['frames'], len(r['tx_m']), len(r['rx_m']), r['loops_per_frame'], r['samples_per_chirp'])
    assert a.shape == (sh if r['sampling'] == 'real' else sh + (2,)) and a.dtype == np.int16, (a.shape, sh)
    if 'valid' in t['files']:
        v = np.load(os.path.join(d, t['files']['valid'])); assert v.dtype == bool and v.shape == sh[:4]
    assert r['adc_start_s'] + r['samples_per_chirp'] / r['sample_rate_hz'] <= r['chirp_period_s'] + 1e-12
    assert r['loops_per_frame'] * len(r['tx_m']) * r['chirp_period_s'] <= r['frame_period_s'] + 1e-12
    sz = os.path.getsize(os.path.join(d, 'if.npy')); assert sz < 16.5e6, sz
    tr = json.load(open(os.path.join(out, 'truth', name + '.json'))); assert {'effects', 'movers', 'notes'} <= set(tr)
    return sz, int(np.abs(a.astype(np.int32)).max()), float(np.sqrt(np.mean(np.asarray(a[:4]).astype(float) ** 2)))
