from panel_stage import DESKTOP, Stage
import asyncio
async def test_dbg(magician: Stage) -> None:
    d = await magician.open(DESKTOP, script="const S=WebSocket.prototype.send; window.log=[]; WebSocket.prototype.send=function(x){ if(!this.w){this.w=1; this.addEventListener('message',e=>{ if(!/tick|state|link/.test(e.data.slice(0,30))) log.push(Math.round(performance.now())+' < '+e.data.slice(0,160)) })} log.push(Math.round(performance.now())+' > '+x.slice(0,140)); return S.call(this,x)}")
    await d.take_control()
    pad = d.page.get_by_role("button", name="x, y: drag here to lead the tool")
    await pad.scroll_into_view_if_needed()
    box = await pad.bounding_box()
    m = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    await d.page.mouse.move(*m)
    await d.page.mouse.down()
    await asyncio.sleep(1.5)
    await d.page.mouse.move(m[0] - 60, m[1], steps=6)
    await asyncio.sleep(2)
    print("WHERE", magician.where(), [ (e.name, e.outcome) for e in magician.sim.arm.executed][-5:]); print("\n".join((await d.page.evaluate("log"))[-12:]))
    print(await d.page.evaluate("document.querySelector('#toasts').innerText"))
    assert 0
